//! Bands of lines in which the excitation is heard.

use super::limits::{BAND_LINES, BAND_SHARE, LEAST_BAND_LINES, LEAST_OF_RECORD};
use super::local_error::Channels;

/// Bands by their upper edges, shares of half of the sample rate; the last is 1.
#[derive(Debug, Clone)]
pub(crate) struct Partition {
    edges: Vec<f64>,
}

impl Partition {
    /// Bands of equal width for so many lines.
    pub(crate) fn equal(lines: usize, channels: Channels) -> Self {
        Self::of_count((lines / (BAND_LINES * channels.q.max(1))).max(1))
    }

    /// So many bands of equal width.
    pub(crate) fn of_count(count: usize) -> Self {
        Partition { edges: (1..=count).map(|k| k as f64 / count as f64).collect() }
    }

    /// Bands that are narrow at low frequency, where responses fall by decades: as wide as a share of their frequency, between
    /// [`LEAST_BAND_LINES`] and [`BAND_LINES`] lines for each excitation, and no narrower than a window resolves in each of some records.
    pub(crate) fn narrow(lines: usize, records: usize, channels: Channels) -> Self {
        let most = (BAND_LINES * channels.q.max(1)).min(lines.max(1));
        let least = (LEAST_BAND_LINES * channels.q.max(1)).max(LEAST_OF_RECORD * records).min(most);
        let (mut edges, mut from) = (Vec::new(), 0);
        // What is left of the last band belongs to the one before it.
        while lines - from >= 2 * most {
            from += ((from as f64 * BAND_SHARE) as usize).clamp(least, most);
            edges.push(from as f64 / lines as f64);
        }
        edges.push(1.0);
        Partition { edges }
    }

    /// Number of bands.
    pub(crate) fn count(&self) -> usize {
        self.edges.len()
    }

    /// Upper edge of the first band.
    pub(crate) fn first(&self) -> f64 {
        self.edges[0]
    }

    /// The band of a share of half of the sample rate.
    pub(crate) fn of(&self, share: f64) -> usize {
        self.edges.partition_point(|edge| *edge <= share).min(self.edges.len() - 1)
    }

    /// Middles of the bands as shares of the sample rate.
    pub(crate) fn middles(&self) -> impl Iterator<Item = f64> {
        let below = std::iter::once(0.0).chain(self.edges.iter().copied());
        self.edges.iter().zip(below).map(|(edge, below)| 0.25 * (below + edge))
    }
}

//! Records that need not fit into memory: the same model by a few passes over a stream.
//!
//! The first pass takes the moments of the channels and the lag sums of the Gram matrix (or R by QR where that is asked for); a
//! second one R by QR where the condition number of the Gram matrix forbids it; then one for B, D and the initial states, and
//! another for these where sums of products would lose too many digits.

use super::batch::{Batch, Pass, Segment, each_batch};
use super::channels::{Channels, check_blocks, check_length, check_ports};
use super::condense::{Condenser, Factors, Regression, Way};
use super::disturbance::KnownColumns;
use super::factorisation::{Choice, Frame, HankelLq, choose};
use super::gram::{Gram, from_lags, interleaved, lag_sums};
use super::hankel_layout::HankelLayout;
use super::order;
use super::row_map::{QrLanes, RowMap};
use super::sensitivity::{Predictor, Unknowns};
use super::statistics::Statistics;
use super::{Factorisation, Order, SubspaceData, SubspaceModel, SubspaceOptions, UncertaintyMethod};
use crate::lti::Discrete;
use crate::signal::SampleStream;
use crate::{Error, Mat, Result};

/// The same as [`super::subspace`] for records that need not fit into memory: two to four passes over the stream, in memory
/// that does not depend on its length: two batches of 4 MB and, by QR, one piece of 4000 rows for each thread.
///
/// The model is that of [`super::subspace`] to rounding errors (`tests::stream::a_stream_gives_the_model_of_the_memory`).
///
/// # Errors
/// As [`super::subspace`], those of the stream, [`Error::RecordChanged`] where two passes give different lengths, and
/// [`Error::Unsupported`] for options that need all samples at once: an automatic horizon, an order by the models of all
/// orders, delays, and an uncertainty.
///
/// ```no_run
/// use youla::identify::subspace::{SubspaceOptions, subspace_stream};
/// use youla::lti::Discrete;
/// use youla_io::{ChannelRef, NpyStream};
/// let [u, y] = [1, 2].map(ChannelRef::Column);
/// let mut stream = NpyStream::open("long.npy", &[u], &[y])?;
/// let found = subspace_stream(&mut stream, Discrete::new(1e-4)?, &SubspaceOptions::default())?;
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn subspace_stream(
    stream: &mut dyn SampleStream,
    time: Discrete,
    options: &SubspaceOptions,
) -> Result<SubspaceModel> {
    require_passes(options)?;
    let (triangle, channels, lengths) = factor(stream, options)?;
    let data = SubspaceData {
        channels,
        triangle,
        time,
        factored: options.clone(),
        asked: options.horizon,
        automatic_horizon: None,
    };
    let options = data.checked(options)?;
    let projected = data.project(&options)?;
    let by_models =
        |_: &_, _| Err(Error::Unsupported { what: "an order by the models of all orders", instead: NEEDS_MEMORY });
    let order = order::choose(options.order, projected.evidence()?, by_models)?;
    let scale = data.channels.scale();
    let condense = &mut |p: &Predictor, u: &Unknowns| condense(stream, &lengths, scale, p, u);
    let scaled = data.scaled_model_by(condense, &projected, order.order, &options)?;
    data.finished(&projected, order, scaled, &options)
}

const NEEDS_MEMORY: &str = "it needs the records in memory: read them as a whole, or leave it out";

/// Refuses options for which all samples would have to be at hand.
fn require_passes(options: &SubspaceOptions) -> Result<()> {
    let by_models = matches!(options.order, Order::Auto(auto) if auto.rule.needs_models());
    let refused = [
        (options.horizon.is_auto(), "an automatic horizon"),
        (by_models, "an order by the models of all orders"),
        (options.delays.iter().any(|delay| *delay > 0), "a delay of an input"),
        (options.uncertainty.method != UncertaintyMethod::None, "an uncertainty"),
    ];
    match refused.into_iter().find(|(asked, _)| *asked) {
        Some((_, what)) => Err(Error::Unsupported { what, instead: NEEDS_MEMORY }),
        None => Ok(()),
    }
}

/// R, what the same pass tells of the channels, and the length of each experiment.
pub(super) fn factor(
    stream: &mut dyn SampleStream,
    options: &SubspaceOptions,
) -> Result<(HankelLq, Channels<'static>, Vec<usize>)> {
    check_blocks(options)?;
    let ports = (stream.inputs(), stream.outputs());
    check_ports(ports.0, ports.1)?;
    let blocks = (options.horizon.past(), options.horizon.future());
    let frame = Frame::new(ports, blocks, HankelLayout::of(options));
    let pass = |lengths| Pass { overlap: frame.blocks() - 1, lengths };
    let mut statistics = Statistics::new(ports.0);
    let mut sums = LagSums::new(ports.0 + ports.1, frame.blocks());
    let mut qr = QrLanes::new(frame.places.len());
    let by_qr = options.factorisation == Factorisation::Qr;
    let lengths = each_batch(stream, &pass(None), |batch| {
        for segment in &batch.segments {
            let (fresh, experiment) = (batch.fresh(segment), segment.experiment);
            if fresh.samples() > 0 {
                statistics.add(fresh, experiment, segment.start + segment.repeated)?;
            }
            if segment.ends {
                check_length(experiment, segment.start + batch.view(segment).samples(), blocks, 0)?;
            }
        }
        if by_qr {
            qr.add(&rows(batch, &frame));
        } else {
            batch.segments.iter().for_each(|segment| sums.add(batch, segment));
        }
        Ok(())
    })?;
    let channels = Channels::read(ports.0, statistics, lengths.len(), options.scaling)?;
    let (samples, experiments) = (lengths.iter().sum::<usize>(), lengths.len());
    let columns = samples + experiments - experiments * frame.blocks();
    frame.require(samples, columns)?;
    let by_gram = if by_qr { None } else { sums.gram.factor(&frame.places) };
    let (r, report) = match choose(by_gram, options.factorisation)? {
        Choice::Gram(found, report) => (found.r, report),
        Choice::Qr(report) => {
            if !by_qr {
                each_batch(stream, &pass(Some(&lengths)), |batch| {
                    qr.add(&rows(batch, &frame));
                    Ok(())
                })?;
            }
            (qr.whole(), report)
        }
    };
    let triangle = frame.triangle(r, channels.scale(), columns, report);
    Ok((triangle, channels, lengths))
}

fn rows<'a>(batch: &'a Batch, frame: &'a Frame) -> RowMap<'a> {
    RowMap::new(batch.segments.iter().map(|segment| batch.view(segment)).collect(), frame.blocks(), &frame.places)
}

/// Accumulates the Gram matrix; of the samples it keeps the first of the current experiment alone.
struct LagSums {
    blocks: usize,
    /// `[L_0 L_1 ...]` of the current experiment.
    lags: Mat<f64>,
    /// The first b - 1 samples of the current experiment.
    head: Vec<f64>,
    /// Of the experiments that have ended.
    gram: Gram,
}

impl LagSums {
    fn new(channels: usize, blocks: usize) -> Self {
        let lags = Mat::zeros(channels, channels * blocks);
        LagSums { blocks, lags, head: Vec::new(), gram: Gram::new(channels, blocks) }
    }

    /// Takes in a segment, which shares b - 1 samples with the one before of the same experiment.
    fn add(&mut self, batch: &Batch, segment: &Segment) {
        let (view, ahead) = (batch.view(segment), self.blocks - 1);
        let edge = |start: usize| interleaved(view.part(start, ahead));
        // Too short an experiment is refused at its end.
        let Some(columns) = view.samples().checked_sub(ahead) else { return };
        if segment.begins {
            self.lags.fill(0.0);
            self.head = edge(0);
        }
        self.lags += lag_sums(view, self.blocks, columns);
        if segment.ends {
            self.gram.add_matrix(from_lags(self.lags.clone(), &self.head, &edge(columns), self.blocks));
        }
    }
}

/// The factors of B, D and x0 by a pass over the stream, or by two.
fn condense(
    stream: &mut dyn SampleStream,
    lengths: &[usize],
    scale: &[f64],
    predictor: &Predictor,
    unknowns: &Unknowns,
) -> Result<Vec<Factors>> {
    let regression = Regression::new(predictor, unknowns, scale.to_vec());
    if let Some(found) = condense_by(stream, lengths, &regression, regression.first_way(), unknowns)? {
        return Ok(found);
    }
    let found = condense_by(stream, lengths, &regression, regression.safe_way(), unknowns)?;
    Ok(found.unwrap_or_default())
}

fn condense_by(
    stream: &mut dyn SampleStream,
    lengths: &[usize],
    regression: &Regression<'_>,
    way: Way,
    unknowns: &Unknowns,
) -> Result<Option<Vec<Factors>>> {
    let none = KnownColumns { known: 0, outputs: unknowns.outputs, crossed: false };
    let mut found: Vec<Option<Factors>> = Vec::new();
    let mut current = Condenser::new(regression, way, none);
    each_batch(stream, &Pass { overlap: 0, lengths: Some(lengths) }, |batch| {
        for segment in &batch.segments {
            let view = batch.view(segment);
            if segment.begins {
                current = Condenser::new(regression, way, none);
            }
            current.add(view.u, view.y, view.w);
            if segment.ends {
                found.push(current.factors());
            }
        }
        Ok(())
    })?;
    Ok(found.into_iter().collect())
}

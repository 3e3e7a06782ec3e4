//! The zones of ISO 14839-3, Mechanical vibration: vibration of rotating machinery equipped with active magnetic bearings,
//! part 3: evaluation of stability margin.

/// Zone by the peak of the sensitivity of an axis, its own loop opened and all others closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum IsoZone {
    /// Below 3 (9.5 dB): new machines.
    A,
    /// Below 4 (12 dB): unrestricted long-term operation.
    B,
    /// Below 5 (14 dB): operation for a limited time, until there is an opportunity for remedy.
    C,
    /// From 5 on: dangerous.
    D,
}

impl IsoZone {
    /// The zone of a peak sensitivity.
    pub fn of(peak: f64) -> Self {
        match peak {
            _ if peak < 3.0 => IsoZone::A,
            _ if peak < 4.0 => IsoZone::B,
            _ if peak < 5.0 => IsoZone::C,
            _ => IsoZone::D,
        }
    }
}

impl std::fmt::Display for IsoZone {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Debug::fmt(self, f)
    }
}

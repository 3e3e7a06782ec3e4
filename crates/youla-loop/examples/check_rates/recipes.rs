//! Of what the logs are made that are checked.

use super::defects;
use super::logs::{PLAIN, Recipe, SHAPES};
use super::machines;

/// Shapes of the clean logs and of those with a defect; the others have all.
const FIRST_SHAPES: usize = 7;

pub(crate) fn clean(seed: usize) -> Recipe {
    let noise = [0.3, 0.1, 0.03, 0.01, 0.0][seed / 7 % 5];
    Recipe {
        kind: seed % machines::KINDS,
        shape: seed % FIRST_SHAPES,
        at_reference: seed / 3 % 5 == 4,
        noise,
        coloured: seed / 11 % 3 == 2,
        bits: (seed / 2 % 4 == 3 && noise > 0.0).then_some(12),
        declared: seed % 3 != 2,
        samples: [3000, 5000, 8000][seed / 13 % 3],
        seed: seed as u64,
        ..PLAIN
    }
}

/// What the others lack: long dead times, integrators with a dead time, inputs that are held, ramps, excitations that are not logged.
pub(crate) fn other(seed: usize) -> Recipe {
    let hold = if seed % 4 == 1 { 2 + seed / 16 % 4 } else { 1 };
    let kind = seed / 8 % machines::ALL_KINDS;
    Recipe {
        // A levitation does not wait for its controller.
        kind: if hold > 1 && kind == 2 { 0 } else { kind },
        shape: seed % SHAPES.len(),
        at_reference: seed / 3 % 4 == 1,
        declared: seed % 3 != 2 && hold == 1,
        known: seed / 5 % 4 != 3,
        hold,
        ramp: if seed / 7 % 3 == 1 { 0.1 } else { 0.0 },
        ..clean(seed)
    }
}

pub(crate) fn with_defect(name: &str, seed: usize) -> Recipe {
    let saturates = name == defects::IN_THE_LOOP[0];
    Recipe {
        // A levitation whose input saturates falls without end.
        kind: match seed % machines::KINDS {
            _ if defects::TWO_BY_TWO.contains(&name) => 3,
            2 if saturates => 0,
            kind => kind,
        },
        at_reference: false,
        noise: [0.1, 0.03, 0.01][seed % 3],
        bits: (seed % 4 == 3).then_some(12),
        limit: saturates.then_some(0.5),
        excited: name != defects::IN_THE_LOOP[1],
        declared: true,
        seed: 10_000 + seed as u64,
        ..clean(seed)
    }
}

//! The loop of a campaign with its host, made of numbers. The firmware for QEMU compiles this file too.

use youla_link::{Machine, Station};
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices};

/// Largest order of the nominal model; a smaller one is filled up with states that are zero.
pub(crate) const STATES: usize = 6;
/// Largest order of Q.
pub const Q_STATES: usize = 20;
/// Numbers of which a station is made: A, B, C, D, F, L, limits, ramp.
pub(crate) const NUMBERS: usize = STATES * STATES + 8 * STATES + 4 + 8 + 3;
/// Rows of a frame.
pub(crate) const ROWS: u16 = 20;

/// Two inputs, two outputs.
pub(crate) type CampaignStation = Station<'static, STATES, 2, 2, Q_STATES>;

const DESCRIPTION: &str = r#"name = "gas bearing"
sample_time = 2e-4
q_order = 20
inputs = [{ name = "u_h", unit = "V" }, { name = "u_v", unit = "V" }]
outputs = [{ name = "y_h", unit = "um" }, { name = "y_v", unit = "um" }]
"#;

/// From [`NUMBERS`] numbers: the matrices by rows; for each output the limits of y and of beta, for each input those of u and of its
/// change; samples for which an input may be clipped, for which an output may be stuck, and of the ramp. `None` where one is not valid.
pub(crate) fn station(numbers: &[f32]) -> Option<CampaignStation> {
    let mut rest = numbers.iter().copied();
    let mut matrices = Matrices {
        a: [[0.0; STATES]; STATES],
        b: [[0.0; 2]; STATES],
        c: [[0.0; STATES]; 2],
        d: [[0.0; 2]; 2],
        f: [[0.0; STATES]; 2],
        l: [[0.0; 2]; STATES],
    };
    let parts = [
        matrices.a.as_flattened_mut(),
        matrices.b.as_flattened_mut(),
        matrices.c.as_flattened_mut(),
        matrices.d.as_flattened_mut(),
        matrices.f.as_flattened_mut(),
        matrices.l.as_flattened_mut(),
    ];
    for place in parts.into_iter().flatten() {
        *place = rest.next()?;
    }
    let mut pair = || Some([rest.next()?, rest.next()?]);
    let (y, beta, u, rate) = (pair()?, pair()?, pair()?, pair()?);
    let mut count = || rest.next().map(|value| value as u16);
    let (clipped, stuck, ramp) = (count()?, count()?, count()?);
    let limits = Limits { y, beta, u, rate, clipped, stuck, host: 0, duration: 0 };
    let running = ExcitedLoop::new(Controller::new(matrices).ok()?, limits, ramp).ok()?;
    Some(Station::new(running, Machine { description: DESCRIPTION, table: &[], rows: ROWS, life: 1 }))
}

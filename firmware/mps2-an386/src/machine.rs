//! Two unstable channels under their controller. The tests on the host compile this file too.

use youla_link::{Machine, Station};
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices};

/// Orders of the model and of Q, inputs, outputs.
pub(crate) type Rig = Station<'static, 2, 2, 2, 2>;

const DESCRIPTION: &str = r#"name = "two unstable channels"
sample_time = 5e-5
inputs = [{ name = "u1", unit = "V" }, { name = "u2", unit = "V" }]
outputs = [{ name = "y1", unit = "um" }, { name = "y2", unit = "um" }]
"#;

static TABLE: [[f32; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];

/// `x+ = 1.1 x + u` and `x+ = 1.05 x + u`, A + B F and A + L C with their poles at 0.5 and 0.4.
pub(crate) fn rig() -> Option<Rig> {
    let controller = Controller::new(Matrices {
        a: [[1.1, 0.0], [0.0, 1.05]],
        b: [[1.0, 0.0], [0.0, 1.0]],
        c: [[1.0, 0.0], [0.0, 1.0]],
        d: [[0.0; 2]; 2],
        f: [[-0.6, 0.0], [0.0, -0.55]],
        l: [[-0.7, 0.0], [0.0, -0.65]],
    });
    let limits = Limits {
        y: [50.0; 2],
        beta: [5.0; 2],
        u: [20.0; 2],
        rate: [30.0; 2],
        clipped: 20,
        stuck: 8,
        host: 100_000,
        duration: 0,
    };
    let running = ExcitedLoop::new(controller.ok()?, limits, 200).ok()?;
    Some(Station::new(running, Machine { description: DESCRIPTION, table: &TABLE, rows: 20, life: 1 }))
}

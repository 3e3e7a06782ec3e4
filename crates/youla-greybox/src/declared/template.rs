//! Declarations that come with the library: the files in `templates/`, read as those of a user.

use serde::{Deserialize, Serialize};

/// A declaration that comes with the library.
///
/// ```
/// use youla_greybox::{Declaration, DeclaredStructure, Structure};
/// let text = "template = 'mass-spring-damper'\n[parameters.mass]\ninitial = 2.5\nfixed = true";
/// let structure = DeclaredStructure::new(&Declaration::parse(text)?)?;
/// assert_eq!(structure.names(), ["damping", "stiffness"]);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Template {
    /// The gas bearing (3)-(6) with the values of the paper.
    Bearing,
    /// One mass between a spring and a damper, from force to displacement.
    MassSpringDamper,
    /// A rigid rotor in two isotropic bearings at a known speed, from forces to displacements in the planes of the bearings.
    RotorGyroscopic,
    /// Motor and load on an elastic shaft, from the torque to the speed of the motor.
    TwoInertiaDrive,
}

impl Template {
    /// All of them.
    pub const ALL: [Template; 4] =
        [Template::Bearing, Template::MassSpringDamper, Template::RotorGyroscopic, Template::TwoInertiaDrive];

    /// The text of the declaration, to start an own one from.
    pub fn text(self) -> &'static str {
        match self {
            Template::Bearing => include_str!("templates/bearing.toml"),
            Template::MassSpringDamper => include_str!("templates/mass-spring-damper.toml"),
            Template::RotorGyroscopic => include_str!("templates/rotor-gyroscopic.toml"),
            Template::TwoInertiaDrive => include_str!("templates/two-inertia-drive.toml"),
        }
    }
}

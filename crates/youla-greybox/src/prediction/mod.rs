//! Predicted outputs of a structure, with their derivatives by the parameters.

pub(crate) mod linearisation;
pub(crate) mod noise;
pub(crate) mod predictor;
pub(crate) mod sampled;
pub(crate) mod sensitivity;
pub(crate) mod sensitivity_bank;
pub(crate) mod simulated;
pub(crate) mod small_qr;
pub(crate) mod steady;
pub(crate) mod whitening;

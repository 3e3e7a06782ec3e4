//! State-space models as structs with the fields `a`, `b`, `c`, `d` and `ts`.

use super::{Value, Variables};
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, MatRef};

impl Value {
    /// A discrete-time system as a struct with the fields `a`, `b`, `c`, `d` and `ts` (seconds).
    ///
    /// ```
    /// use youla::{Mat, lti::{Discrete, StateSpace}, record::Value};
    /// let system = StateSpace::gain(Mat::zeros(2, 1), Discrete::new(2e-4)?)?;
    /// assert_eq!(Value::model(&system).description(), "1 x 1 struct");
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn model(system: &StateSpace<Discrete>) -> Value {
        let matrices = [("a", system.a()), ("b", system.b()), ("c", system.c()), ("d", system.d())];
        let fields = matrices.map(|(name, matrix): (_, MatRef<f64>)| (name, Value::matrix(matrix)));
        Value::structure(fields.into_iter().chain([("ts", Value::scalar(system.time().ts()))]))
    }
}

impl Variables {
    /// The real matrix at a path.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`], or [`Error::WrongVariable`] for anything but a real matrix.
    pub fn matrix(&self, path: &str) -> Result<Mat<f64>> {
        match self.get(path)? {
            Value::Real { dims, data } if dims.len() == 2 => {
                Ok(MatRef::from_column_major_slice(data, dims[0], dims[1]).to_owned())
            }
            other => Err(Error::WrongVariable {
                path: self.path().to_owned(),
                name: path.to_owned(),
                found: other.description(),
                must: "a real matrix",
            }),
        }
    }

    /// The discrete-time system at the path of a struct with the fields `a`, `b`, `c`, `d` and `ts`.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`] for a missing field, [`Error::WrongVariable`] for a field of another kind, and those of
    /// [`StateSpace::new`] and [`Discrete::new`].
    pub fn model(&self, path: &str) -> Result<StateSpace<Discrete>> {
        let matrix = |name: &str| self.matrix(&format!("{path}.{name}"));
        let time = Discrete::new(self.scalar(&format!("{path}.ts"))?)?;
        StateSpace::new(matrix("a")?, matrix("b")?, matrix("c")?, matrix("d")?, time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::scratch::scratch;
    use crate::record::{Packing, Variable, read_mat, write_mat};

    #[test]
    fn models_return_exactly() {
        let mat = |rows, columns| Mat::from_fn(rows, columns, |i, j| ((1 + i + 3 * j) as f64).sqrt());
        let time = Discrete::new(2e-4).unwrap();
        for order in [0, 1, 3] {
            let system = StateSpace::new(mat(order, order), mat(order, 2), mat(1, order), mat(1, 2), time).unwrap();
            let file = scratch("mat");
            let variable = Variable { name: "plant".into(), value: Value::model(&system) };
            write_mat(file.path(), &[variable], Packing::Zlib).unwrap();
            let variables = read_mat(file.path()).unwrap();
            assert_eq!(variables.model("plant").unwrap(), system);
            assert!(matches!(variables.model("plan"), Err(Error::UnknownChannel { .. })));
            assert!(matches!(variables.matrix("plant"), Err(Error::WrongVariable { .. })));
        }
    }
}

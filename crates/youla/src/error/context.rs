//! What the error enums of all crates share: the part of a task in which an error occurred, and its kind.

/// Gives the error enum `Error` of a module `within` and `kind`. The enum has a variant `Within { part: String, source: Box<Error> }`.
///
/// `sources` names the variants that hold the error of another crate, whose kind is theirs; every other variant is named under the kind
/// that it has, so that a new one does not compile until its kind is stated.
///
/// ```
/// #[derive(Debug)]
/// enum Error {
///     Method(youla::Error),
///     Within { part: String, source: Box<Error> },
///     NoStart,
/// }
/// youla::error_context! {
///     sources: Method;
///     numerical:;
///     bad_input: NoStart;
/// }
/// assert_eq!(Error::NoStart.within("[grey_box]").kind(), youla::ErrorKind::BadInput);
/// ```
#[macro_export]
macro_rules! error_context {
    (sources: $($source:ident)*; numerical: $($numerical:ident)*; bad_input: $($bad_input:ident)*;) => {
        impl Error {
            /// The same error with the part of a larger task in which it occurred.
            pub fn within(self, part: impl Into<String>) -> Self {
                Error::Within { part: part.into(), source: Box::new(self) }
            }

            /// Whether the input is invalid or a computation failed.
            pub fn kind(&self) -> $crate::ErrorKind {
                match self {
                    Error::Within { source, .. } => source.kind(),
                    $(Error::$source(source) => source.kind(),)*
                    $(Error::$numerical { .. } => $crate::ErrorKind::Numerical,)*
                    $(Error::$bad_input { .. } => $crate::ErrorKind::BadInput,)*
                }
            }
        }
    };
}

//! Arithmetic of named quantities, kept as a postfix program, which a loop evaluates: no length of an expression exhausts
//! the stack.

use super::dual::Dual;

/// Functions of one argument.
pub(super) const FUNCTIONS: [&str; 10] = ["sqrt", "exp", "ln", "sin", "cos", "tan", "atan", "tanh", "abs", "sign"];
/// Constants.
pub(super) const CONSTANTS: [&str; 1] = ["pi"];

/// An expression over numbered names.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expression {
    program: Vec<Step>,
}

/// One step: an operand onto the stack, or an operator on the topmost ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    Number(f64),
    Name(usize),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Call(&'static str),
}

impl Expression {
    /// A program, complete as the grammar makes it.
    pub(super) fn new(program: Vec<Step>) -> Self {
        Expression { program }
    }

    /// The value where the names have the given values.
    pub(super) fn evaluate(&self, values: &[Dual]) -> Dual {
        let mut stack: Vec<Dual> = Vec::new();
        for step in &self.program {
            let result = match step {
                Step::Number(value) => Dual::constant(*value),
                Step::Name(number) => values[*number],
                Step::Negate => pop(&mut stack).negated(),
                Step::Call(function) => call(function, pop(&mut stack)),
                binary => {
                    let right = pop(&mut stack);
                    let left = pop(&mut stack);
                    match binary {
                        Step::Add => left.plus(right),
                        Step::Subtract => left.minus(right),
                        Step::Multiply => left.by(right),
                        Step::Divide => left.over(right),
                        _ => left.power(right),
                    }
                }
            };
            stack.push(result);
        }
        pop(&mut stack)
    }

    /// The names that are in it, by number.
    pub(super) fn names(&self) -> impl Iterator<Item = usize> {
        self.program.iter().filter_map(|step| if let Step::Name(number) = step { Some(*number) } else { None })
    }
}

/// The topmost operand; the grammar leaves no operator without its operands.
fn pop(stack: &mut Vec<Dual>) -> Dual {
    stack.pop().unwrap_or(Dual::constant(f64::NAN))
}

fn call(function: &str, x: Dual) -> Dual {
    let v = x.value;
    match function {
        "sqrt" => x.chain(v.sqrt(), 0.5 / v.sqrt()),
        "exp" => x.chain(v.exp(), v.exp()),
        "ln" => x.chain(v.ln(), 1.0 / v),
        "sin" => x.chain(v.sin(), v.cos()),
        "cos" => x.chain(v.cos(), -v.sin()),
        "tan" => x.chain(v.tan(), 1.0 + v.tan() * v.tan()),
        "tanh" => x.chain(v.tanh(), 1.0 - v.tanh() * v.tanh()),
        "abs" => x.chain(v.abs(), sign(v)),
        "sign" => x.chain(sign(v), 0.0),
        _ => x.chain(v.atan(), 1.0 / (1.0 + v * v)),
    }
}

/// -1, 0 or 1.
fn sign(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

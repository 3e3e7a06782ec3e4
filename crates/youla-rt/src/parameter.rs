//! The parameter Q of K(Q), exchanged while the loop runs.

use crate::matrices::plus;
use crate::ramp::Ramp;
use crate::{Checksum, Real};
use core::fmt;

/// Why Q was not taken. What ran before goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QRefusal {
    /// The bank still fades out after the last switch: wait and begin again.
    Fading,
    /// A coefficient is not finite.
    NotFinite,
    /// Fewer or more coefficients than the bank holds.
    Count,
    /// The coefficients have another checksum than stated.
    Checksum,
    /// No complete Q is loaded.
    NotLoaded,
}

impl fmt::Display for QRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            QRefusal::Fading => "the bank of Q still fades out after the last switch; load again later",
            QRefusal::NotFinite => "a coefficient of Q is not finite",
            QRefusal::Count => "Q has another number of coefficients than its bank",
            QRefusal::Checksum => "the coefficients of Q have another checksum than stated; send them again",
            QRefusal::NotLoaded => "no complete Q is loaded; load one before the switch",
        })
    }
}

impl core::error::Error for QRefusal {}

/// `x+ = A x + B beta, alpha = C x` with K states, M inputs and P outputs of the plant. There is no feedthrough, because the
/// command comes before the measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QCoefficients<T, const K: usize, const M: usize, const P: usize> {
    /// State matrix, K x K, stable; Q of a lower order is filled up with zeros.
    pub a: [[T; K]; K],
    /// Input matrix, K x P.
    pub b: [[T; P]; K],
    /// Output matrix, M x K.
    pub c: [[T; K]; M],
}

impl<T: Real, const K: usize, const M: usize, const P: usize> QCoefficients<T, K, M, P> {
    /// Q = 0.
    #[must_use]
    pub fn zero() -> Self {
        QCoefficients { a: [[T::ZERO; K]; K], b: [[T::ZERO; P]; K], c: [[T::ZERO; K]; M] }
    }

    /// All coefficients in the order in which they are loaded: A, B, C, each by rows.
    pub fn values(&self) -> impl Iterator<Item = T> + '_ {
        self.a.as_flattened().iter().chain(self.b.as_flattened()).chain(self.c.as_flattened()).copied()
    }

    /// The checksum that [`ExcitedLoop::commit_q`](crate::ExcitedLoop::commit_q) expects.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        let mut checksum = Checksum::new();
        self.values().for_each(|value| value.append_to(&mut checksum));
        checksum.value()
    }

    fn entry(&mut self, index: usize) -> Option<&mut T> {
        let (of_a, of_b) = (K * K, K * P);
        match index {
            i if i < of_a => self.a.as_flattened_mut().get_mut(i),
            i if i < of_a + of_b => self.b.as_flattened_mut().get_mut(i - of_a),
            i => self.c.as_flattened_mut().get_mut(i - of_a - of_b),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    Empty,
    Ready,
    /// Between beta and alpha.
    Connected,
    /// Its free response runs out.
    Fading,
}

#[derive(Debug, Clone, PartialEq)]
struct Bank<T, const K: usize, const M: usize, const P: usize> {
    q: QCoefficients<T, K, M, P>,
    x: [T; K],
    role: Use,
    fade: Ramp<T>,
}

impl<T: Real, const K: usize, const M: usize, const P: usize> Bank<T, K, M, P> {
    fn new(fade: u16) -> Self {
        Bank { q: QCoefficients::zero(), x: [T::ZERO; K], role: Use::Empty, fade: Ramp::new(fade) }
    }

    fn add_output(&self, role: Use, sum: &mut [T; M]) {
        if self.role != role {
            return;
        }
        let weight = if role == Use::Fading { self.fade.weight() } else { T::ONE };
        let output = plus([T::ZERO; M], &self.q.c, &self.x);
        for (sum, value) in sum.iter_mut().zip(&output) {
            *sum = *sum + *value * weight;
        }
    }

    /// False where the state is not finite any more; it is then 0 and the bank unused.
    fn advance(&mut self, beta: &[T; P], tripped: bool) -> bool {
        match self.role {
            Use::Empty | Use::Ready => return true,
            Use::Connected => self.x = plus(plus([T::ZERO; K], &self.q.a, &self.x), &self.q.b, beta),
            Use::Fading => {
                self.x = plus([T::ZERO; K], &self.q.a, &self.x);
                self.fade(tripped);
            }
        }
        let finite = self.x.iter().all(|x| x.is_finite());
        if !finite {
            self.x = [T::ZERO; K];
            self.role = Use::Empty;
        }
        finite
    }

    fn disconnect(&mut self) {
        if self.role == Use::Connected {
            self.role = Use::Fading;
            self.fade = self.fade.at_top();
        }
    }

    fn fade(&mut self, fast: bool) {
        if self.role == Use::Fading {
            if fast {
                self.fade.drop_out()
            } else {
                self.fade.fall()
            }
            if self.fade.is_zero() {
                self.role = Use::Ready;
            }
        }
    }
}

/// Two banks of Q. The one that is not connected is loaded, coefficient by coefficient, and then connected at one sample.
///
/// The switch is bumpless for any two Q: the new one starts from the state 0, the old one has no input any more, and its free
/// response, faded to 0, is added to alpha. After the switch the loop is thus that of K(new Q), excited by a signal of finite length;
/// it is stable wherever that loop is, and alpha is continuous at the switch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct QBanks<T, const K: usize, const M: usize, const P: usize> {
    banks: [Bank<T, K, M, P>; 2],
    /// Whether the second bank is the one to load and to connect next.
    second: bool,
    loaded: usize,
    checksum: Checksum,
}

impl<T: Real, const K: usize, const M: usize, const P: usize> QBanks<T, K, M, P> {
    const COUNT: usize = K * K + K * P + M * K;

    pub(crate) fn new(fade: u16) -> Self {
        QBanks {
            banks: [Bank::new(fade), Bank::new(fade)],
            second: false,
            loaded: Self::COUNT,
            checksum: Checksum::new(),
        }
    }

    fn next(&mut self) -> &mut Bank<T, K, M, P> {
        let [first, second] = &mut self.banks;
        if self.second { second } else { first }
    }

    pub(crate) fn begin(&mut self) -> Result<(), QRefusal> {
        let next = self.next();
        if next.role == Use::Fading {
            return Err(QRefusal::Fading);
        }
        next.role = Use::Empty;
        self.loaded = 0;
        self.checksum = Checksum::new();
        Ok(())
    }

    pub(crate) fn write(&mut self, value: T) -> Result<(), QRefusal> {
        let place = self.loaded;
        if self.next().role != Use::Empty || place >= Self::COUNT {
            return Err(QRefusal::Count);
        }
        if !value.is_finite() {
            self.loaded = Self::COUNT + 1;
            return Err(QRefusal::NotFinite);
        }
        match self.next().q.entry(place) {
            Some(entry) => *entry = value,
            None => return Err(QRefusal::Count),
        }
        value.append_to(&mut self.checksum);
        self.loaded = place + 1;
        Ok(())
    }

    pub(crate) fn commit(&mut self, checksum: u32) -> Result<(), QRefusal> {
        let complete = self.loaded == Self::COUNT;
        let expected = self.checksum.value();
        let next = self.next();
        if next.role != Use::Empty || !complete {
            return Err(QRefusal::Count);
        }
        if expected != checksum {
            return Err(QRefusal::Checksum);
        }
        next.role = Use::Ready;
        Ok(())
    }

    pub(crate) fn connect(&mut self) -> Result<(), QRefusal> {
        let next = self.next();
        match next.role {
            Use::Fading => return Err(QRefusal::Fading),
            Use::Ready => {}
            Use::Empty | Use::Connected => return Err(QRefusal::NotLoaded),
        }
        self.disconnect();
        let next = self.next();
        next.x = [T::ZERO; K];
        next.role = Use::Connected;
        self.second = !self.second;
        Ok(())
    }

    /// Q = 0 from the next sample on, but for the free response of what was connected.
    pub(crate) fn disconnect(&mut self) {
        self.banks.iter_mut().for_each(Bank::disconnect);
    }

    /// The same, out within `OUT_WITHIN` samples.
    pub(crate) fn drop_out(&mut self) {
        self.disconnect();
        self.banks.iter_mut().for_each(|bank| bank.fade(true));
    }

    /// C x of the connected bank: the part of the controller K(Q).
    pub(crate) fn feedback(&self) -> [T; M] {
        self.output(Use::Connected)
    }

    /// The free responses that fade out: excitation, as far as the loop is concerned.
    pub(crate) fn fading(&self) -> [T; M] {
        self.output(Use::Fading)
    }

    fn output(&self, role: Use) -> [T; M] {
        let mut sum = [T::ZERO; M];
        self.banks.iter().for_each(|bank| bank.add_output(role, &mut sum));
        sum
    }

    /// False where a state overflowed.
    pub(crate) fn advance(&mut self, beta: &[T; P], tripped: bool) -> bool {
        let [first, second] = &mut self.banks;
        let finite = first.advance(beta, tripped);
        second.advance(beta, tripped) && finite
    }

    /// 0: none, 1: the first, 2: the second.
    pub(crate) fn connected(&self) -> u32 {
        let roles = (1..).zip(&self.banks);
        roles.filter(|(_, bank)| bank.role == Use::Connected).map(|(number, _)| number).sum()
    }

    pub(crate) fn is_fading(&self) -> bool {
        self.banks.iter().any(|bank| bank.role == Use::Fading)
    }

    /// The coefficients that are connected.
    pub(crate) fn running(&self) -> Option<&QCoefficients<T, K, M, P>> {
        self.banks.iter().find(|bank| bank.role == Use::Connected).map(|bank| &bank.q)
    }
}

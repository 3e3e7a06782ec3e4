//! Every constant that decides a verdict, with its unit and origin. Rates of false alarms and misses: `docs/accuracy.md`.

/// Lines of a band for each channel of the excitation. Enough for the power of the noise within 16 % (`1 / sqrt(40)`); a band of 40 lines of a
/// record of 12 000 samples is 0.3 % of the sample rate wide.
pub(crate) const BAND_LINES: usize = 40;
/// Least lines of a band for each channel of the excitation, at low frequency: four that count, of which three are left to estimate the noise from.
pub(crate) const LEAST_BAND_LINES: usize = 8;
/// Width of a band over its frequency, between these limits: half of the window over which bands are averaged.
pub(crate) const BAND_SHARE: f64 = 0.12;
/// Least lines of a band in each of several records: a line under a Hann window holds three.
pub(crate) const LEAST_OF_RECORD: usize = 3;
/// Lines under a Hann window that count as one: `sum of |correlation|^2 = 1 + 2 (2/3)^2 + 2 (1/6)^2`.
pub(crate) const HANN_LOSS: f64 = 35.0 / 18.0;
/// Directions of the excitation with less than this share of its mean power per band are left out: rounding of a log of five digits. A move of
/// 30 rad fills the mean; beside it an excitation of 0.1 N m has 1e-4 of it.
pub(crate) const WEAK_EXCITATION: f64 = 1e-10;
/// Least power of an input that a direction of the excitation explains, over the power of what it leaves per line: of noise alone a band
/// exceeds it in one of 150 cases, `exp(-5)`.
pub(crate) const LEAST_EXPLAINED: f64 = 5.0;
/// Least singular value of the excited inputs over the largest from which a direction counts as excited: of an error of the model along the
/// strong direction one per cent leaks into the weak one, 3 times that error. References through an inverse of a distillation column, whose
/// gains have the quotient 140, move its weak direction by 0.007 of the strong one, far above the noise.
pub(crate) const LEAST_DIRECTION: f64 = 0.003;
/// The same from which the errors of several records are compared, whose noise must be exceeded in every direction then: a machine that varies
/// has errors along the strong direction, and what leaks of them into a weak one varies too. One per cent of leakage is 30 % of them.
pub(crate) const LEAST_COMPARED: f64 = 0.03;
/// Least power that the excitation moves along a direction of the inputs, over that of the noise there: the quotient of two sums is biased
/// towards the inverse of the controller by its inverse, 3 %.
pub(crate) const LEAST_MOVED: f64 = 30.0;
/// Half width of the window over which bands are averaged, a ratio of frequencies: 1 dB, a third of an octave in all.
pub(crate) const BAND_RATIO: f64 = 1.122;
/// Least number of bands in a window.
pub(crate) const LEAST_BANDS: usize = 5;
/// Standard deviations beyond chance from which one of the windows of a record shows an error. Of 100 independent windows one exceeds
/// 4.0 in one of 300 records.
pub(crate) const LOCAL_CHANCE: f64 = 4.0;
/// The same where the errors of all windows together exceed chance by as much.
pub(crate) const OVERALL_CHANCE: f64 = 3.0;

/// Standard deviations beyond chance up to which a figure is accepted whatever its size: of the 10^4 figures of many runs none
/// exceeds it by chance.
pub(crate) const BEYOND_CHANCE: f64 = 5.0;

/// Standard deviations by which an estimated size may exceed its limit: one in 40 by chance where it is at the limit.
pub(crate) const NEAR_THE_LIMIT: f64 = 2.0;

/// Largest part of the margin of the loop that the 95 % region may take: half of the margin is left.
pub(crate) const LARGEST_RATIO_OF_LOOP: f64 = 0.5;
/// Largest error that the excitation shows, as `|E K (I - G K)^-1|`: beside it the loop keeps its margins within 2 dB. Loops of the
/// gauntlet with good models have a median of 0.026, with wrong ones of 0.28.
pub(crate) const LARGEST_LOOP_ERROR: f64 = 0.2;
/// Largest error of the stated controller, as `|(I - K G)^-1 dK G|`: a gain that is wrong by 20 % has 0.2 and more, a delay of one sample
/// where the loop crosses over at a thirtieth of the sample rate less than 0.1.
pub(crate) const LARGEST_CONTROLLER_ERROR: f64 = 0.15;
/// Largest standard deviation of a response, relative to it, in a band of validity.
pub const LARGEST_IN_BAND: f64 = 0.1;
/// Radius of the 95 % region of a complex number over its root mean square: `sqrt(chi-square(0.95, 2) / 2)`.
pub(crate) const EDGE: f64 = 1.731;
/// Lowest frequency at which a loop is judged over the lowest at which the region is stated.
pub(crate) const BELOW_ONE_PERIOD: f64 = 1.0;
/// Residual of the controller's equation over its inputs up to which the log is that of the controller: rounding of nine digits in a log
/// gives 1e-8, of five 1e-4.
pub(crate) const NEARLY_EXACT: f64 = 1e-4;
/// Share of the samples, those of the largest inputs, that may have been logged before a limit: the law of the controller must hold exactly in
/// all others. A tenth leaves half of the samples to a law of four states.
pub(crate) const LARGEST_INPUTS: f64 = 0.1;
/// An input is at a limit where its extreme value occurs at least so often, and in at most one of so many samples.
pub(crate) const AT_LIMIT: (usize, usize) = (3, 2);
/// Largest relative deviation of the difference of two parts of the records where they are compared, and of the response as the excitation alone
/// shows it at the ends of a band of validity. Chosen.
pub(crate) const KNOWN: f64 = 0.3;
/// What the squares of the deviations of a model are multiplied with that leaves a mode to the noise at a frequency that the excitation shows: no
/// autoregression is as narrow. Of three axes with cogging the errors were up to 3.5 deviations.
pub(crate) const CANCELLED_MODE: f64 = 9.0;
/// Largest ratio of the noise powers of two parts of the records: beyond it the model leaves in one what it explains in the other.
pub(crate) const LARGEST_NOISE_RATIO: f64 = 3.0;
/// Standard deviation over the response, median over frequency, up to which a model of an open loop says anything.
pub(crate) const LARGEST_DEVIATION: f64 = 1.0;
/// Largest nonlinear part of the input over the input. Dry friction of 1 to 5 % of the torque has 0.01 to 0.03, measured drives and
/// pendulums 0.02 to 0.03, friction of half of the torque 0.07 to 0.2 (8 of 9 machines), 0.03 where it hardly differs from viscous friction.
pub(crate) const LARGEST_NONLINEAR: f64 = 0.05;
/// Share of the power of the nonlinear part of an input, over that of the input, that stays as a mean square error of the response: the lines
/// that a mode ties together average the rest. Of 8 machines with dry friction of 1 to 5 % the error over the whole part has a median of 0.46.
pub(crate) const LASTING: f64 = 0.25;
/// Dry friction at other masses over that which a record shows at its output. On 12 simulated axes with three tenths of the friction at the load,
/// 37 to 70 % of the power of all is found, on the machines with friction at the motor all of it.
pub(crate) const FRICTION_ELSEWHERE: f64 = 0.25;
/// Largest share of the output that a function of the inputs explains behind friction: a command logged before it is cut at 1.2 deviations
/// leaves 0.02 and more, a measured pendulum 0.008.
pub(crate) const LARGEST_OF_INPUT: f64 = 0.015;
/// Play of an output over its size from which backlash is named as large. Chosen: a tenth of what a band of validity allows. A note says where
/// it is beyond chance and more so than friction: in all of 10 loops with play of 0.4 to 1 %, in none of 10 with friction, in 1 of 138 others
/// (a log that was described wrongly).
pub(crate) const LARGEST_PLAY: f64 = 0.01;
/// Change of the gain over the records from which a drift is named as large. Chosen: a fifth of what a band of validity allows. Of 10 loops
/// with a drift of 3.3 % all are named, with 3.2 to 3.5 %; none of 148 others.
pub(crate) const LARGEST_CHANGE_OF_GAIN: f64 = 0.02;
/// Largest difference of the models from parts of the records over the response, averaged over a third of an octave, where the feedback does
/// not suppress it. Measured drives and pendulums have up to 0.31, a resonance that moved by 20 % 0.79 and more.
pub(crate) const LARGEST_DIFFERENCE: f64 = 0.5;
/// Largest part of the margin that the region may take where only what the excitation moves counts.
pub(crate) const INFORMATION_RATIO: f64 = 1.0;
/// A part of the margin beyond which its size says nothing more.
pub(crate) const NO_INFORMATION: f64 = 1e3;
/// Gain of the closed loop above the frequencies that the excitation shows, from which a mode there is named as a danger: modes of machines rise by 20 dB
/// above the response beside them. Of 15 trusted models of simulated disc drives that lack the resonance of the arm, with an error above 0.3 in the loop,
/// 12 exceed it, of 109 other trusted models 9.
pub(crate) const LARGEST_UNSEEN_GAIN: f64 = 0.1;
/// Amplitude of a line of a disturbance, over the size of the outputs, that is named as large.
pub(crate) const LARGEST_LINE: f64 = 1.0;
/// Size of a load that changes in steps, over the size of the inputs, that is named as large.
pub(crate) const LARGEST_LOAD: f64 = 1.0;
/// Steps of load within 600 samples up to which they are steps. A push of 100 to 600 samples at the input leaves 4 to 8 in five of six records, of
/// which two models were wrong and trusted; steps at intervals of 50 samples and an exponential of 2500 have four in one record of 170.
pub(crate) const MOST_STEPS: f64 = 3.0;
/// Residual of the controller's equation over its inputs up to which the controller enters the estimate: it decides whether a direct path of
/// the plant can be told from the feedback.
pub(crate) const AS_STATED: f64 = 0.02;

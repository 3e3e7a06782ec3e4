//! Loops whose stability between the ends is known.

use super::*;

fn first_order(pole: f64, gain: f64) -> StateSpace<Discrete> {
    let of = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    StateSpace::new(of(pole), of(1.0), of(gain), of(0.0), Discrete::new(1e-3).unwrap()).unwrap()
}

/// Whether the loop at (w, v) is stable.
fn stable(q: [&StateSpace<Discrete>; 2], s: [&StateSpace<Discrete>; 2], w: f64, v: f64) -> bool {
    let open = mixed(s, v).unwrap().then(&mixed(q, w).unwrap()).unwrap().negated();
    let one = StateSpace::gain(eye(1), open.time()).unwrap();
    open.plus(&one).unwrap().inverse().unwrap().is_stable().unwrap()
}

#[test]
fn evidence_holds_on_a_grid_and_for_departures_of_s() {
    let (q0, q1) = (first_order(0.5, 0.3), first_order(0.6, -0.4));
    let (s0, s1) = (first_order(0.7, 0.2), first_order(0.8, -0.1));
    let found = between_points([&q0, &q1], [&s0, &s1]).unwrap().unwrap();
    assert!(found.gain < 1.0 && found.room > 0.0 && found.q_room > 0.0);
    // S_1 - S_0 is largest at zero frequency: -0.1 / 0.2 - 0.2 / 0.3.
    assert!((found.change - 7.0 / 6.0).abs() < 2e-3, "{}", found.change);
    let grid = || (0..=20).map(|k| f64::from(k) / 20.0);
    assert!(grid().all(|w| grid().all(|v| stable([&q0, &q1], [&s0, &s1], w, v))));
    // A departure just within the room, static and of both signs.
    for sign in [-1.0, 1.0] {
        let with = |s: &StateSpace<Discrete>| {
            s.plus(&StateSpace::gain(eye(1) * faer::Scale(0.99 * sign * found.room), s.time()).unwrap()).unwrap()
        };
        let (s0, s1) = (with(&s0), with(&s1));
        assert!(grid().all(|w| grid().all(|v| stable([&q0, &q1], [&s0, &s1], w, v))));
    }
}

/// Each Q stabilises its own S, `Q S = -0.9 z^-2`, and neither that of the other end: there `Q S` is 81 times or a ninth of it.
#[test]
fn an_unstable_loop_between_stable_ends_is_found() {
    let delay = |gain: f64| first_order(0.0, gain);
    let (q, s) = ([&delay(0.1), &delay(8.1)], [&delay(-9.0), &delay(-0.9 / 8.1)]);
    assert!(stable(q, s, 0.0, 0.0) && stable(q, s, 1.0, 1.0) && !stable(q, s, 0.5, 0.5));
    assert_eq!(between_points(q, s).unwrap(), None);
}

/// A loop that is stable everywhere, but by more than one square shows.
#[test]
fn squares_are_divided_until_they_show_it() {
    let (q0, q1) = (first_order(0.9, 0.0), first_order(0.9, -0.5));
    let (s0, s1) = (first_order(0.2, 0.1), first_order(0.2, 0.8));
    let found = between_points([&q0, &q1], [&s0, &s1]).unwrap().unwrap();
    assert!(found.squares > 1 && found.gain < 1.0, "{found:?}");
}

#[test]
fn q_between_is_the_mean_within_its_bound() {
    let (q0, q1) = (first_order(0.5, 0.3), first_order(0.6, -0.4));
    let whole = q_between([&q0, &q1], 0.25, 2).unwrap();
    assert!(whole.q.order() == 2 && whole.error < 1e-8);
    let difference = whole.q.plus(&mixed([&q0, &q1], 0.25).unwrap().negated()).unwrap();
    assert!(norm(&difference).unwrap() < 1e-12);
    let reduced = q_between([&q0, &q1], 0.25, 1).unwrap();
    let difference = reduced.q.plus(&whole.q.negated()).unwrap();
    let error = norm(&difference).unwrap();
    assert!(reduced.q.order() == 1 && error <= 1.001 * reduced.error && error > 0.01, "{error} {}", reduced.error);
    // The ends are not touched; equal ends have all in common.
    assert_eq!(q_between([&q0, &q1], 1.0, 1).unwrap().q.order(), 1);
    assert_eq!(q_between([&q0, &q0], 0.5, 1).unwrap().q.order(), 1);
}

//! The diagram finds the modes of the bearing and of measured data; its poles are those of the models.

use super::super::stabilisation::{PoleStability, StabilisationOptions, modal_assurance, stabilisation};
use super::*;
use crate::Error;
use crate::error::OrderLimit;

const WEIGHTS: [SubspaceMethod; 6] = [
    SubspaceMethod::Moesp,
    SubspaceMethod::N4sid,
    SubspaceMethod::Cva,
    SubspaceMethod::PbsidOpt,
    SubspaceMethod::Ssarx,
    SubspaceMethod::ParsimS,
];

/// The poles of each order are those of the model of that order, and the shapes `C v` of its output matrix.
#[test]
fn poles_and_shapes_are_those_of_the_models() {
    let (u, y, time) = bearing_record(2000, 0.1, 1);
    for method in WEIGHTS {
        let method = SubspaceOptions { method, horizon: 10.into(), stability: Stability::Allow, ..Default::default() };
        let data = SubspaceData::new(&one(&u, &y), time, &method).unwrap();
        let diagram = stabilisation(&data, &[3, 6, 7], &method, &StabilisationOptions::default()).unwrap();
        for order in [3, 6, 7] {
            let found = data.identify(&SubspaceOptions { order: Order::Fixed(order), ..method.clone() }).unwrap();
            let model = &found.model;
            let of_order: Vec<_> = diagram.poles.iter().filter(|p| p.order == order).collect();
            let count: usize = of_order.iter().map(|p| if p.pole.im > 0.0 { 2 } else { 1 }).sum();
            assert_eq!(count, order);
            for pole in of_order {
                // (z I - A) has the eigenvector in its null space; C times it is the shape.
                let n = model.order();
                let pencil = Mat::from_fn(n, n, |i, j| {
                    c64::new(-model.a()[(i, j)], 0.0) + if i == j { pole.pole } else { c64::new(0.0, 0.0) }
                });
                let svd = pencil.svd().unwrap();
                let least = svd.S().column_vector()[n - 1].re / svd.S().column_vector()[0].re;
                assert!(least < 1e-9, "{method:?}, order {order}: {least:e}");
                let v = svd.V().col(n - 1);
                let shape: Vec<c64> = (0..2).map(|i| (0..n).map(|k| v[k] * model.c()[(i, k)]).sum::<c64>()).collect();
                assert!(modal_assurance(&shape, &pole.shape) > 1.0 - 1e-8, "{method:?}, order {order}");
                assert!((pole.shape.iter().map(|x| x.norm()).fold(0.0, f64::max) - 1.0).abs() < 1e-12);
            }
        }
    }
}

/// The bearing has modes of 209.7 Hz (damping ratio 0.102) and 217.6 Hz (0.082). Each method finds both, and nothing else, in
/// orders 1 to 24 from 20000 samples with 0.2 um of noise: within 0.2 Hz and 0.003. They are settled at 18 orders or more,
/// whatever follows the noise at 7 or less.
#[test]
fn clusters_find_the_modes_of_the_bearing() {
    let plant = crate::fixtures::bearing();
    let truth: Vec<_> = plant.modes().unwrap().into_iter().filter(|m| m.zeta < 0.5).collect();
    let orders: Vec<usize> = (1..=24).collect();
    for seed in 1..=3 {
        let (u, y, time) = bearing_record(20_000, 0.2, seed);
        for method in WEIGHTS {
            let method = SubspaceOptions { method, horizon: 30.into(), ..Default::default() };
            let data = SubspaceData::new(&one(&u, &y), time, &method).unwrap();
            let draw = |share| {
                let options = StabilisationOptions { share, ..Default::default() };
                stabilisation(&data, &orders, &method, &options).unwrap().clusters
            };
            let clusters = draw(0.5);
            assert_eq!((clusters.len(), truth.len()), (2, 2), "{method:?}, seed {seed}: {clusters:?}");
            for (found, mode) in clusters.iter().zip(&truth) {
                let errors = ((found.hz - mode.hz).abs(), (found.zeta - mode.zeta).abs());
                assert!(errors.0 < 0.2 && errors.1 < 0.003, "{method:?}, seed {seed}: {found:?}");
                assert!(found.settled >= 18 && found.hz_spread < 0.1, "{method:?}, seed {seed}: {found:?}");
            }
            let others = draw(0.0).into_iter().map(|c| c.settled).filter(|settled| *settled < 18).max();
            assert!(others.is_some_and(|settled| settled <= 7), "{method:?}, seed {seed}: {others:?}");
        }
    }
}

#[test]
fn what_makes_no_diagram_is_refused() {
    let (u, y, time) = bearing_record(1000, 0.1, 1);
    let method = SubspaceOptions { horizon: 5.into(), ..Default::default() };
    let data = SubspaceData::new(&one(&u, &y), time, &method).unwrap();
    let draw = |orders: &[usize], options| stabilisation(&data, orders, &method, &options).err();
    let usual = StabilisationOptions::default();
    assert!(draw(&[1, 8], usual).is_none());
    assert!(matches!(draw(&[2, 9], usual), Some(Error::Order { limit: OrderLimit::Horizon { largest: 8, .. }, .. })));
    for orders in [&[0, 1][..], &[2, 2], &[3, 2]] {
        assert!(matches!(draw(orders, usual), Some(Error::OutOfRange { .. })));
    }
    let bad = StabilisationOptions { mac: 1.5, ..usual };
    assert!(matches!(draw(&[2], bad), Some(Error::OutOfRange { .. })));
    assert!(toml::from_str::<StabilisationOptions>("frequncy = 0.1").is_err());
}

/// No pole settles at the lowest order; each cluster holds what its poles say.
#[test]
fn standings_and_clusters_agree_with_the_poles() {
    let (u, y, time) = bearing_record(4000, 0.1, 2);
    let method = SubspaceOptions { horizon: 20.into(), ..Default::default() };
    let data = SubspaceData::new(&one(&u, &y), time, &method).unwrap();
    let orders: Vec<usize> = (2..=16).collect();
    let diagram = stabilisation(&data, &orders, &method, &StabilisationOptions::default()).unwrap();
    assert!(diagram.poles.iter().filter(|p| p.order == 2).all(|p| p.standing == PoleStability::New));
    assert!(diagram.poles.iter().any(|p| p.standing == PoleStability::Stable));
    for (place, cluster) in diagram.clusters.iter().enumerate() {
        let members: Vec<_> = diagram.poles.iter().filter(|p| p.cluster == Some(place)).collect();
        let mut of_orders: Vec<usize> = members.iter().map(|p| p.order).collect();
        of_orders.dedup();
        assert_eq!(of_orders.len(), cluster.orders);
        let mut settled: Vec<usize> =
            members.iter().filter(|p| p.standing == PoleStability::Stable).map(|p| p.order).collect();
        settled.dedup();
        assert_eq!(settled.len(), cluster.settled);
        assert!(2 * cluster.settled >= orders.len() && members.iter().all(|p| p.pole.im > 0.0));
        let below = members.iter().filter(|p| p.hz < cluster.hz).count();
        let above = members.iter().filter(|p| p.hz > cluster.hz).count();
        assert_eq!(below, above);
    }
}

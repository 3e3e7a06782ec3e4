//! What an output sees of noise at the inputs: the gains of the plant on some of the lines, without modes that are lines of the noise.

use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::state_lanes::resolvent;
use faer::c64;
use pulp::{Arch, NullaryFnOnce};
use std::f64::consts::TAU;
use std::ops::Range;

/// Product of input and output of a block over the largest below which an output does not see what the inputs move there.
const UNSEEN: f64 = 1e-8;
/// Half width of a mode, in lines of the longest record, below which it is a line of the noise and not a peak: what a disturbance leaves has 0.005
/// to 0.1.
pub(crate) const NARROW: f64 = 0.3;
/// About how many lines show the size of the noise.
pub(crate) const LINES: usize = 6000;

/// `|G_i|^2` of the blocks that an output sees, on some of the lines.
pub(crate) struct Gains {
    /// Per record lines x p.
    pub(crate) values: Vec<Vec<f64>>,
    /// Every how many lines.
    pub(crate) every: usize,
    /// Blocks that are left out, for each output.
    pub(crate) hidden: Vec<Vec<usize>>,
}

impl Gains {
    pub(crate) fn new(model: &Model, spectra: &Spectra) -> Self {
        let longest = longest(spectra);
        let hidden: Vec<Vec<usize>> =
            (0..model.outputs).map(|output| hidden(model, longest, output..output + 1)).collect();
        let every = spectra.lines().div_ceil(LINES).max(1);
        let blocks: Vec<Block> = model.blocks.iter().map(Block::quickened).collect();
        let inputs = model.inputs;
        let of = |lines: &Lines| {
            let z: Vec<c64> = lines.z.iter().step_by(every).copied().collect();
            let mut out = Vec::with_capacity(z.len() * hidden.len());
            let each = |_, (g, l): (&[Lanes], usize)| {
                let square = |g: &Lanes| g.re[l] * g.re[l] + g.im[l] * g.im[l];
                out.extend(g.chunks(inputs).map(|g| g.iter().map(square).sum::<f64>()));
            };
            Arch::new().dispatch(Responses { blocks: &blocks, inputs, hidden: &hidden, z: &z, each });
            out
        };
        Gains { values: spectra.records.iter().map(of).collect(), every, hidden }
    }
}

/// Blocks that none of some outputs sees, and modes that are lines of the noise.
pub(crate) fn hidden(model: &Model, longest: f64, outputs: Range<usize>) -> Vec<usize> {
    let reach = |block: &Block| {
        let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        size(&block.b) * size(&block.c[outputs.start * block.states..outputs.end * block.states])
    };
    let largest = model.blocks.iter().map(reach).fold(0.0, f64::max);
    let left_out = |block: &Block| reach(block) <= UNSEEN * largest || is_line(block, longest);
    (0..model.blocks.len()).filter(|k| left_out(&model.blocks[*k])).collect()
}

/// Whether a mode is a line of the noise, by the samples of the longest record.
pub(crate) fn is_line(block: &Block, longest: f64) -> bool {
    block.poles().iter().any(|p| p.im != 0.0 && p.norm().ln().abs() * longest < NARROW * TAU)
}

/// Whether a mode is a line of the noise.
pub(crate) fn has_line(model: &Model, spectra: &Spectra) -> bool {
    let longest = longest(spectra);
    model.blocks.iter().any(|block| is_line(block, longest))
}

/// Samples of the longest record.
pub(crate) fn longest(spectra: &Spectra) -> f64 {
    spectra.records.iter().map(|lines| lines.samples).max().unwrap_or(0) as f64
}

/// The responses of the blocks that an output sees, p x m, at some lines, with the widest instructions that the processor has.
pub(crate) struct Responses<'a, F> {
    pub(crate) blocks: &'a [Block],
    pub(crate) inputs: usize,
    pub(crate) hidden: &'a [Vec<usize>],
    pub(crate) z: &'a [c64],
    /// Takes the place of a line, and its response as one of the lanes.
    pub(crate) each: F,
}

impl<F: FnMut(usize, (&[Lanes], usize))> NullaryFnOnce for Responses<'_, F> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Responses { blocks, inputs: m, hidden, z, mut each } = self;
        let largest = blocks.iter().map(|b| b.states).max().unwrap_or(0);
        let (mut inverse, mut x) = (vec![Lanes::ZERO; largest * largest], vec![Lanes::ZERO; largest]);
        let mut g = vec![Lanes::ZERO; hidden.len() * m];
        for (group, z) in z.chunks(LANES).enumerate() {
            let at = Lanes::gather(|l| z[l.min(z.len() - 1)]);
            g.fill(Lanes::ZERO);
            for (place, block) in blocks.iter().enumerate() {
                let s = block.states;
                resolvent(block, &at, &mut inverse);
                for j in 0..m {
                    x[..s].fill(Lanes::ZERO);
                    for (i, l) in (0..s).flat_map(|i| (0..s).map(move |l| (i, l))) {
                        x[i].add_scaled(&inverse[i * s + l], block.b[l * m + j]);
                    }
                    for (o, hidden) in hidden.iter().enumerate() {
                        if !hidden.contains(&place) {
                            (0..s).for_each(|i| g[o * m + j].add_scaled(&x[i], block.c[o * s + i]));
                        }
                    }
                }
            }
            for l in 0..z.len() {
                each(group * LANES + l, (&g, l));
            }
        }
    }
}

//! Residuals of many recordings, and their derivatives along the unknowns.

use rayon::prelude::*;

use crate::likelihood::Rule;

/// The samples of one channel of a recording.
#[derive(Debug, Clone, Copy)]
pub struct Channel<'a> {
    /// Its place among the model's outputs.
    pub column: usize,
    /// At which of the model's times it was read; None: at all.
    pub rows: Option<&'a [i64]>,
    /// What was read.
    pub read: &'a [f64],
    pub rule: Rule,
}

/// What the model says of a recording.
#[derive(Debug, Clone)]
pub struct Said<'a> {
    /// (times, outputs).
    pub values: &'a [f64],
    pub outputs: usize,
    pub channels: Vec<Channel<'a>>,
}

/// The model's slopes along its parameters, and along what a recording has of its own.
#[derive(Debug, Clone)]
pub struct Slopes<'a> {
    /// (times, outputs, directions).
    pub slopes: &'a [f64],
    pub directions: usize,
    /// Which directions are the recording's own unknowns, and how far one unit of each goes.
    pub own: Vec<(usize, f64)>,
}

/// How parameters go with the shared unknowns: each with one.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Of each direction before the recordings' own: its unknown, and its derivative along that.
    pub of: Vec<(usize, f64)>,
    pub unknowns: usize,
    /// Whether each unknown is one parameter, in their order.
    straight: bool,
}

impl Chain {
    pub fn new(of: Vec<(usize, f64)>, unknowns: usize) -> Self {
        let straight = of.len() == unknowns && of.iter().enumerate().all(|(k, one)| one.0 == k);
        Chain { of, unknowns, straight }
    }
}

/// A recording at one place; channels follow each other.
#[derive(Debug, Clone, Default)]
pub struct Linearised {
    /// (samples,).
    pub residual: Vec<f64>,
    /// (samples,) what the model says.
    pub model: Vec<f64>,
    /// (samples, unknowns and own) of the residual.
    pub jacobian: Vec<f64>,
    /// The same of what the model says, where it was asked for.
    pub slope: Vec<f64>,
}

impl Said<'_> {
    fn samples(&self) -> usize {
        self.channels.iter().map(|channel| channel.read.len()).sum()
    }

    /// Of every sample: the model's row, what was read, and by which rule; channel by channel.
    fn each(&self) -> impl Iterator<Item = (usize, usize, f64, &Rule)> {
        self.channels.iter().flat_map(|channel| {
            channel.read.iter().enumerate().map(|(k, &read)| {
                let row = channel.rows.map_or(k, |rows| rows[k] as usize);
                (row, channel.column, read, &channel.rule)
            })
        })
    }

    /// (samples,).
    pub fn residual(&self) -> Vec<f64> {
        self.each()
            .map(|(row, column, read, rule)| rule.residual(read, self.values[row * self.outputs + column]))
            .collect()
    }

    /// With derivatives; `slopes_too`: of the model as well.
    pub fn linearised(&self, along: &Slopes<'_>, chain: &Chain, slopes_too: bool) -> Linearised {
        let (samples, wide) = (self.samples(), chain.unknowns + along.own.len());
        let mut found = Linearised {
            residual: Vec::with_capacity(samples),
            model: Vec::with_capacity(samples),
            jacobian: Vec::with_capacity(samples * wide),
            slope: Vec::with_capacity(if slopes_too { samples * wide } else { 0 }),
        };
        let mut turned = vec![0.0; wide];
        for (row, column, read, rule) in self.each() {
            let cell = row * self.outputs + column;
            let (residual, weight) = rule.misfit(read, self.values[cell]);
            found.residual.push(residual);
            found.model.push(self.values[cell]);
            let raw = &along.slopes[cell * along.directions..][..along.directions];
            turn(raw, &along.own, chain, &mut turned);
            found.jacobian.extend(turned.iter().map(|one| one * weight));
            if slopes_too {
                found.slope.extend_from_slice(&turned);
            }
        }
        found
    }
}

/// Slopes along parameters and conditions as slopes along the unknowns.
#[inline]
fn turn(raw: &[f64], own: &[(usize, f64)], chain: &Chain, out: &mut [f64]) {
    if chain.straight {
        for ((out, &raw), &(_, factor)) in out.iter_mut().zip(raw).zip(&chain.of) {
            *out = raw * factor;
        }
    } else {
        out.fill(0.0);
        for (&raw, &(unknown, factor)) in raw.iter().zip(&chain.of) {
            out[unknown] += raw * factor;
        }
    }
    for (out, &(direction, width)) in out[chain.unknowns..].iter_mut().zip(own) {
        *out = raw[direction] * width;
    }
}

/// Every recording's residuals, on all cores.
pub fn residuals(recordings: &[Said<'_>]) -> Vec<Vec<f64>> {
    recordings.par_iter().map(Said::residual).collect()
}

/// Every recording linearised, on all cores.
pub fn linearised(recordings: &[(Said<'_>, Slopes<'_>)], chain: &Chain, slopes_too: bool) -> Vec<Linearised> {
    recordings.par_iter().map(|(said, along)| said.linearised(along, chain, slopes_too)).collect()
}

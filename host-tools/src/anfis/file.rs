//! A training's result as the file of its network.

use super::{Method, Trained};
use crate::network::{FORMAT, File, Input, Rule, Training};

impl Trained {
    /// The file of the network, with the names of its `inputs` and its `target`. `margin` is how far outside the
    /// trained box the output fades to zero, as a fraction of the box.
    pub fn file(&self, method: Method, margin: f64, inputs: &[String], target: &str) -> File {
        let net = &self.net;
        File {
            anfis: FORMAT,
            shape: net.shape.into(),
            firing: net.firing.into(),
            target: target.to_owned(),
            output: self.output.into(),
            margin,
            training: Training {
                greyrig: env!("CARGO_PKG_VERSION").to_owned(),
                method: match method {
                    Method::Varpro => "varpro".to_owned(),
                    Method::Hybrid => "hybrid".to_owned(),
                },
                ridge: self.ridge,
                epochs: self.epochs.len(),
                rmse_trn: self.rmse_trn,
                rmse_chk: self.rmse_chk,
            },
            input: inputs
                .iter()
                .zip(&self.inputs)
                .zip(net.premise.chunks(net.functions))
                .map(|((name, range), functions)| Input {
                    name: name.clone(),
                    range: (*range).into(),
                    functions: functions.iter().map(|p| [p.a, p.b, p.c]).collect(),
                })
                .collect(),
            rule: net
                .consequents
                .chunks(net.inputs + 1)
                .zip(&self.support)
                .map(|(c, support)| Rule {
                    slopes: c[..net.inputs].to_vec(),
                    constant: c[net.inputs],
                    support: support.largest,
                })
                .collect(),
        }
    }
}

//! The parameters of a network and what it puts out.

use greyrig::anfis::{self, Firing, Premise, Shape};

use crate::error::{Error, Result};

/// A first-order Takagi–Sugeno network on a full grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Net {
    /// Form of the membership functions.
    pub shape: Shape,
    /// Firing operator.
    pub firing: Firing,
    /// Number of inputs n.
    pub inputs: usize,
    /// Number M of membership functions of each input.
    pub functions: usize,
    /// Premise parameters, the functions of the first input first.
    pub premise: Vec<Premise>,
    /// Consequent parameters, n slopes and the constant of each rule; the last input's functions vary fastest.
    pub consequents: Vec<f64>,
}

impl Net {
    /// The grid to start from: centres equally spaced over each range, bells that cross at μ = 0.5 with the given b,
    /// and Gaussians that cross there, too. Consequents are zero.
    pub fn grid(shape: Shape, firing: Firing, b: f64, functions: usize, ranges: &[(f64, f64)]) -> Self {
        let premise = ranges
            .iter()
            .flat_map(|&(low, high)| {
                let spacing = if functions > 1 { (high - low) / (functions as f64 - 1.0) } else { high - low };
                (0..functions).map(move |j| Premise {
                    a: match shape {
                        Shape::Bell => spacing / 2.0,
                        // exp(−(s/2)²/(2a²)) = 1/2
                        Shape::Gaussian => spacing / 2.0 / (2.0 * std::f64::consts::LN_2).sqrt(),
                    },
                    b,
                    c: if functions > 1 { low + spacing * j as f64 } else { (low + high) / 2.0 },
                })
            })
            .collect();
        let inputs = ranges.len();
        let consequents = vec![0.0; anfis::consequent_parameters(inputs, functions)];
        Self { shape, firing, inputs, functions, premise, consequents }
    }

    /// Number of rules.
    pub fn rules(&self) -> usize {
        anfis::rules(self.inputs, self.functions)
    }

    /// Number of consequent parameters.
    pub fn columns(&self) -> usize {
        anfis::consequent_parameters(self.inputs, self.functions)
    }

    /// The membership function of an input that a rule has.
    pub fn function_of(&self, rule: usize, input: usize) -> usize {
        rule / self.functions.pow((self.inputs - 1 - input) as u32) % self.functions
    }

    /// The membership of a value in a function.
    pub fn membership(&self, input: usize, function: usize, x: f64) -> f64 {
        let Premise { a, b, c } = self.premise[input * self.functions + function];
        let z = (x - c) / a;
        match self.shape {
            Shape::Bell => 1.0 / (1.0 + z.abs().powf(2.0 * b)),
            Shape::Gaussian => (-0.5 * z * z).exp(),
        }
    }

    /// The output at a point, layer by layer. For many rows the trainer has a faster way.
    pub fn output(&self, x: &[f64]) -> f64 {
        let mu: Vec<f64> = (0..self.inputs)
            .flat_map(|i| (0..self.functions).map(move |j| (i, j)))
            .map(|(i, j)| self.membership(i, j, x[i]).max(f64::MIN_POSITIVE))
            .collect();
        let (mut sum, mut total) = (0.0, 0.0);
        for rule in 0..self.rules() {
            let mine = (0..self.inputs).map(|i| mu[i * self.functions + self.function_of(rule, i)]);
            let strength = match self.firing {
                Firing::Product => mine.product(),
                Firing::Minimum => mine.fold(1.0, f64::min),
            };
            let consequent = &self.consequents[rule * (self.inputs + 1)..][..=self.inputs];
            let f = x.iter().zip(consequent).fold(consequent[self.inputs], |f, (x, p)| f + p * x);
            sum += strength * f;
            total += strength;
        }
        sum / total
    }

    /// The same network in other units of the inputs: each x becomes (x − centre)/half.
    #[must_use]
    pub fn scaled(&self, scales: &[Scale]) -> Self {
        let mut net = self.clone();
        for (premises, s) in net.premise.chunks_mut(self.functions).zip(scales) {
            for p in premises {
                *p = Premise { a: p.a / s.half, b: p.b, c: (p.c - s.centre) / s.half };
            }
        }
        for rule in net.consequents.chunks_mut(self.inputs + 1) {
            for (k, s) in scales.iter().enumerate() {
                rule[self.inputs] += rule[k] * s.centre;
                rule[k] *= s.half;
            }
        }
        net
    }

    /// Back from the other units.
    #[must_use]
    pub fn unscaled(&self, scales: &[Scale]) -> Self {
        let back: Vec<Scale> =
            scales.iter().map(|s| Scale { centre: -s.centre / s.half, half: 1.0 / s.half }).collect();
        self.scaled(&back)
    }

    /// As settings of the core, for a network of exactly that size.
    ///
    /// # Errors
    /// Another size.
    pub fn to_core<const N: usize, const M: usize, const RULES: usize>(
        &self,
        inputs: [(f64, f64); N],
        output: (f64, f64),
        margin: f64,
    ) -> Result<anfis::Settings<N, M, RULES>> {
        if (self.inputs, self.functions, self.rules()) != (N, M, RULES) {
            return Err(Error::usage(
                format!("the network has {} inputs with {} membership functions each", self.inputs, self.functions),
                format!("train one of {N} inputs with {M} each"),
            ));
        }
        let width = N + 1;
        Ok(anfis::Settings {
            shape: self.shape,
            firing: self.firing,
            premise: std::array::from_fn(|i| std::array::from_fn(|j| self.premise[i * M + j])),
            slopes: std::array::from_fn(|r| std::array::from_fn(|i| self.consequents[r * width + i])),
            constants: std::array::from_fn(|r| self.consequents[r * width + N]),
            inputs,
            output,
            margin,
        })
    }
}

/// Where an input's range lies: x = centre + half · u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Middle of the range.
    pub centre: f64,
    /// Half its width.
    pub half: f64,
}

impl Scale {
    /// None: u is x.
    pub const NONE: Self = Self { centre: 0.0, half: 1.0 };

    /// That of a range.
    pub fn of((low, high): (f64, f64)) -> Self {
        Self { centre: 0.5 * (low + high), half: 0.5 * (high - low) }
    }
}

//! ANFIS: the network that learns what the physical model leaves, after J.-S. R. Jang, "ANFIS: adaptive-network-based
//! fuzzy inference system", IEEE Transactions on Systems, Man, and Cybernetics 23(3), 1993.
//!
//! Rules of the first-order Takagi–Sugeno kind, "if x is A and y is B then f = p x + q y + r", on a full grid:
//! every combination of the inputs' membership functions is a rule.
//!
//! | layer | nodes | what |
//! | --- | --- | --- |
//! | 1 membership | N M | μ = 1/(1 + \|(x − c)/a\|^(2b)), premise parameters a, b, c |
//! | 2 firing | M^N | w = product of the rule's memberships (or the smallest) |
//! | 3 normalisation | M^N | w̄ = w/Σw |
//! | 4 consequent | M^N | w̄ (p x + q y + … + r), consequent parameters p, q, …, r |
//! | 5 output | 1 | sum of these |
//!
//! Three inputs with three functions each make 27 rules with 27 premise and 108 consequent parameters in 91 nodes
//! ([`rules`], [`premise_parameters`], [`consequent_parameters`], [`nodes`]).
//!
//! ```
//! use greyrig::anfis::{Firing, Premise, Settings, Shape};
//!
//! // Two rules on one input: y = −x on the left, y = +x on the right.
//! let settings = Settings::<1, 2, 2> {
//!     shape: Shape::Bell,
//!     firing: Firing::Product,
//!     premise: [[Premise { a: 1.0, b: 2.0, c: -1.0 }, Premise { a: 1.0, b: 2.0, c: 1.0 }]],
//!     slopes: [[-1.0], [1.0]],
//!     constants: [0.0, 0.0],
//!     inputs: [(-1.0, 1.0)],
//!     output: (-1.0, 1.0),
//!     margin: 0.1,
//! };
//! let network = settings.build::<f32>()?;
//! assert_eq!(network.correct([0.0]).value, 0.0);
//! assert_eq!(network.correct([0.5]).validity, 1.0);
//! assert_eq!(network.correct([f32::NAN]).validity, 0.0);
//! # Ok::<(), greyrig::anfis::SettingsError>(())
//! ```
//!
//! # Evaluation
//!
//! On a full grid with the product, w̄ = Π μ_ij/Σ_j μ_ij: one normalisation of M terms for each input instead of one of
//! M^N, and no 0/0. The rules are then summed input by input. The count of instructions is the same for every input,
//! and no step branches on data (the form of the membership functions and the operator are branched on, which do not
//! change).
//!
//! # Where it can be relied on
//!
//! - Inputs are clamped to the trained box, the output to the range of the training targets.
//! - Outside the box the correction fades: with the distance ρ from the box, in margins, the validity is
//!   (1 − ρ²)² up to ρ = 1 and 0 beyond. Value and slope are continuous.
//! - A NaN or an infinity gives value 0 and validity 0.
//! - A membership below 2^-32 counts as 2^-32.
//! # Example
//! ```
//! use greyrig::anfis::{Firing, Premise, Settings, SettingsError, Shape};
//!
//! // Two inputs with two membership functions each make four rules; trained on the square ±1.
//! let bells = [Premise { a: 1.0, b: 2.0, c: -1.0 }, Premise { a: 1.0, b: 2.0, c: 1.0 }];
//! let network = Settings::<2, 2, 4> {
//!     shape: Shape::Bell,
//!     firing: Firing::Product,
//!     premise: [bells; 2],
//!     slopes: [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]],
//!     constants: [0.0; 4],
//!     inputs: [(-1.0, 1.0); 2],
//!     output: (-1.0, 1.0),
//!     margin: 0.1,
//! }
//! .build::<f32>()?;
//! assert_eq!(network.correct([0.5, 0.5]).validity, 1.0);
//! assert_eq!(network.correct([2.0, 0.0]).validity, 0.0); // far from where it has been trained
//! # Ok::<(), SettingsError>(())
//! ```

mod kernel;
mod network;
mod settings;

pub use kernel::{EXP2_ERROR, Kernel, LOG2_ERROR};
pub use network::{Anfis, Correction, Firing};
pub use settings::{MAX_EXPONENT, MAX_WIDTHS, Premise, Settings, SettingsError, Shape};

/// The network of the rig: three inputs, three membership functions each, in `f32`.
pub type Anfis3x3 = Anfis<f32, 3, 3, 27>;
/// Settings of the rig's network.
pub type Settings3x3 = Settings<3, 3, 27>;

/// Number of rules of a full grid: M^N.
pub const fn rules(inputs: usize, functions: usize) -> usize {
    functions.pow(inputs as u32)
}

/// Number of premise parameters: a, b, c of each membership function.
pub const fn premise_parameters(inputs: usize, functions: usize) -> usize {
    3 * inputs * functions
}

/// Number of consequent parameters: a slope for each input and a constant, of each rule.
pub const fn consequent_parameters(inputs: usize, functions: usize) -> usize {
    rules(inputs, functions) * (inputs + 1)
}

/// Number of nodes in the five layers.
pub const fn nodes(inputs: usize, functions: usize) -> usize {
    inputs * functions + 3 * rules(inputs, functions) + 1
}

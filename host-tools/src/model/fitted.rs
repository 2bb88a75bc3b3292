//! What a model file remembers of the data that it was fitted to: for predictions with a band, and for telling where
//! they leave what was seen.

use greyrig::motor::BaseParameter;
use serde::{Deserialize, Serialize};

use super::Model;
use crate::between::Course;
use crate::error::{Error, Place, Result};

/// What the fit has seen, and what it has left over. A model file may lack it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fitted {
    /// What the voltage was taken to do between its samples, if that was one for all recordings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<Course>,
    /// Share of the interval by which the supply was switched before a sample, where it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input_share: Option<f64>,
    /// What was seen.
    pub range: Range,
    /// What the free run leaves of the current, A.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Scatter>,
    /// What it leaves of the speed, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<Scatter>,
    /// How well the parameters are known together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Uncertainty>,
}

/// Least and largest values of the recordings and of the model's free run through them, SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Voltage, V.
    pub u_v: [f64; 2],
    /// Current, A.
    pub i_a: [f64; 2],
    /// Speed, rad/s.
    pub omega_rad_s: [f64; 2],
}

/// Standard deviation σ of measured − modelled at a sample, by what the model does there:
/// `σ² = floor² + (of_current î)² + (of_speed ω̂)² + (of_current_rate dî/dt)² + (of_speed_rate dω̂/dt)²`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// At rest, in the signal's unit: the noise of the measuring chain.
    pub floor: f64,
    /// Per ampere.
    pub of_current: f64,
    /// Per rad/s.
    pub of_speed: f64,
    /// Per A/s.
    pub of_current_rate: f64,
    /// Per rad/s².
    pub of_speed_rate: f64,
    /// Share of the samples that lie within so many σ, and that number; rising.
    pub within: Vec<[f64; 2]>,
}

/// Standard deviations of the estimated parameters and their correlations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Uncertainty {
    /// Names of the parameters; an unknown of the second term is `term2.NAME`.
    pub names: Vec<String>,
    /// Their standard deviations, SI.
    pub deviations: Vec<f64>,
    /// Their correlations, row by row, of each row as far as the diagonal.
    pub correlations: Vec<Vec<f64>>,
    /// Degrees of freedom of the deviations.
    pub freedom: f64,
}

impl Uncertainty {
    /// Correlation of two parameters.
    pub fn correlation(&self, row: usize, column: usize) -> f64 {
        self.correlations[row.max(column)][row.min(column)]
    }

    fn is_whole(&self) -> bool {
        let n = self.names.len();
        let rows = &self.correlations;
        self.deviations.len() == n
            && self.correlations.len() == n
            && self.deviations.iter().all(|d| d.is_finite() && *d >= 0.0)
            && rows.iter().enumerate().all(|(k, row)| row.len() == k + 1)
            && rows.iter().flatten().all(|r| (-1.0..=1.0).contains(r))
            && self.freedom >= 1.0
    }
}

impl Scatter {
    fn is_usable(&self) -> bool {
        let sizes = [self.floor, self.of_current, self.of_speed, self.of_current_rate, self.of_speed_rate];
        let rises = self.within.windows(2).all(|w| w[0][0] < w[1][0] && w[0][1] <= w[1][1]);
        let shares = self.within.iter().all(|[share, times]| (0.0..1.0).contains(share) && *times >= 0.0);
        sizes.iter().all(|x| x.is_finite() && *x >= 0.0) && rises && shares && !self.within.is_empty()
    }
}

impl Fitted {
    /// Checks what a file says; `at` is where a key stands in it.
    ///
    /// # Errors
    /// Numbers that cannot be, or parameters that the model does not have.
    pub(super) fn check(&self, model: &Model, at: &dyn Fn(&str) -> Place) -> Result<()> {
        let remedy = "correct it, or remove [fitted] and all its parts: predictions then have no band";
        let bad = |key: &str, what: String| Err(Error::input(at(key), what, remedy));
        let Range { u_v, i_a, omega_rad_s } = self.range;
        if [u_v, i_a, omega_rad_s].iter().any(|[low, high]| !(low.is_finite() && high.is_finite() && low <= high)) {
            return bad("[fitted.range]", "a range goes from its least to its largest value".into());
        }
        for (key, scatter) in [("[fitted.current]", &self.current), ("[fitted.speed]", &self.speed)] {
            if scatter.as_ref().is_some_and(|scatter| !scatter.is_usable()) {
                return bad(key, "deviations are not negative, and what lies within them rises".into());
            }
        }
        let Some(uncertainty) = &self.uncertainty else { return Ok(()) };
        let key = "[fitted.uncertainty]";
        if !uncertainty.is_whole() {
            return bad(key, "it takes a deviation and a row of correlations, from -1 to 1, for each name".into());
        }
        match uncertainty.names.iter().find(|name| model.value_of(name).is_none()) {
            Some(stranger) => bad(key, format!("the model has no parameter {stranger}")),
            None => Ok(()),
        }
    }
}

/// Name of an unknown of a term by the term's place.
pub fn name_in_term(place: usize, name: &str) -> String {
    format!("term{}.{name}", place + 1)
}

impl Model {
    /// The value of a parameter by its name in [`Uncertainty`].
    pub fn value_of(&self, name: &str) -> Option<f64> {
        self.clone().value_mut(name).copied()
    }

    /// The same, to change it.
    pub fn value_mut(&mut self, name: &str) -> Option<&mut f64> {
        if let Some((term, unknown)) = name.strip_prefix("term").and_then(|rest| rest.split_once('.')) {
            let place = term.parse::<usize>().ok()?.checked_sub(1)?;
            return Some(&mut self.terms.get_mut(place)?.parameters.get_mut(unknown)?.value);
        }
        if BaseParameter::of_name(name).is_some() {
            return Some(&mut self.parameters.get_mut(name)?.value);
        }
        Some(&mut self.effects.iter_mut().find_map(|e| e.parameters.get_mut(name))?.value)
    }
}

//! What is watched of a motor over the time of its test, between the limits that healthy ones keep; and where it lies
//! among them.

use super::replay::Row;
use super::test::Test;
use crate::model::DetectorEntry;

/// What a healthy motor keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Band {
    /// Its magnitude is below a limit.
    Below(f64),
    /// It is within a half-width of a centre.
    Within {
        /// What is usual.
        centre: f64,
        /// How far from that a healthy motor may be.
        half: f64,
    },
}

impl Band {
    const fn within([centre, half]: [f64; 2]) -> Self {
        Self::Within { centre, half }
    }

    /// How far a value is on its way from what is usual to its limit: above 1 it calls. Zero, where there is no limit.
    pub fn ratio(self, value: f64) -> f64 {
        let (beyond, most) = match self {
            Self::Below(limit) => (value.abs(), limit),
            Self::Within { centre, half } => ((value - centre).abs(), half),
        };
        if most > 0.0 { beyond / most } else { 0.0 }
    }
}

/// Something that is watched.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// In words.
    pub name: &'static str,
    /// Unit; `1` of a ratio.
    pub unit: &'static str,
    /// Its limits.
    pub band: Band,
    /// Time, s, and value of each period that was judged.
    pub points: Vec<[f64; 2]>,
}

/// A figure of a motor among those of the healthy ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// In words.
    pub name: String,
    /// Unit; `1` of a ratio or a logarithm of one.
    pub unit: &'static str,
    /// What the motor shows.
    pub value: f64,
    /// What healthy ones show.
    pub band: Band,
}

/// All that is watched, period by period.
pub fn courses(test: &Test, detector: &DetectorEntry) -> Vec<Course> {
    let course = |name, unit, band, of: &dyn Fn(&Row) -> f32| Course {
        name,
        unit,
        band,
        points: test.replay.judged().map(|row| [row.t_s, f64::from(of(row))]).collect(),
    };
    let d = detector;
    vec![
        course("error of the current", "1", Band::Below(d.current), &|r| r.features.current),
        course("error of the speed", "1", Band::Below(d.speed), &|r| r.features.speed),
        course("current above 1 kHz", "A", Band::Below(d.sparking), &|r| r.features.sparking),
        course("abrupt change of the current", "1", Band::Below(d.current_jump), &|r| r.jumps[0]),
        course("abrupt change of the speed", "1", Band::Below(d.speed_jump), &|r| r.jumps[1]),
        course("deviation of the current", "1", Band::within(d.current_deviation), &|r| r.features.current_deviation),
        course("deviation of the speed", "1", Band::within(d.speed_deviation), &|r| r.features.speed_deviation),
    ]
}

/// The motor's means over its test, and its own parameters where they were estimated, among those of healthy motors.
pub fn places(test: &Test, detector: &DetectorEntry) -> Vec<Place> {
    if test.periods[0] == 0 {
        return Vec::new();
    }
    let f = &test.features;
    let place =
        |name: &str, unit, value: f32, band| Place { name: name.to_owned(), unit, value: f64::from(value), band };
    let within = Band::within;
    let mut all = vec![
        place("deviation of the current", "1", f.current_deviation, within(detector.current_deviation)),
        place("deviation of the speed", "1", f.speed_deviation, within(detector.speed_deviation)),
        place("current above 1 kHz", "A", f.sparking, Band::Below(detector.sparking)),
    ];
    let own = test.parameters.iter().filter_map(|(name, value)| {
        let band = within(*detector.parameters.get(name)?);
        Some(Place { name: format!("{name}, ln of its ratio to the type's"), unit: "1", value: *value, band })
    });
    all.extend(own);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_at_its_limit_has_the_ratio_one() {
        let within = Band::Within { centre: 0.5, half: 0.25 };
        assert_eq!([0.25, 0.5, 0.75, 1.0].map(|x| within.ratio(x)), [1.0, 0.0, 1.0, 2.0]);
        assert_eq!([-2.0, 0.0, 1.0].map(|x| Band::Below(2.0).ratio(x)), [1.0, 0.0, 0.5]);
        assert_eq!(Band::Below(0.0).ratio(3.0), 0.0, "what has no limit never calls");
    }
}

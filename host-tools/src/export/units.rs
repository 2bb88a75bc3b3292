//! Units as exponents of the base units.

/// Exponents of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Exponents {
    /// Of kilogram, metre, second, ampere, kelvin and radian.
    pub of: [i32; 6],
}

/// The base units, as both versions of the interface write them.
pub const NAMES: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

impl Exponents {
    /// Of a unit as the model file and the catalogue write it, such as `N m s2/rad2` or `V s/(rad A)`; none where an
    /// exponent is no whole number, or a symbol is not known.
    pub fn parse(unit: &str) -> Option<Self> {
        let (over, under) = unit.split_once('/').map_or((unit, ""), |(over, under)| (over, under));
        let under = under.strip_prefix('(').map_or(Some(under), |rest| rest.strip_suffix(')'))?;
        let mut of = [0; 6];
        for (part, sign) in [(over, 1), (under, -1)] {
            for symbol in part.split_whitespace() {
                let (symbol, power) = power(symbol)?;
                for (sum, exponent) in of.iter_mut().zip(base(symbol)?) {
                    *sum += sign * power * exponent;
                }
            }
        }
        Some(Self { of })
    }
}

/// A symbol and the power behind it.
fn power(symbol: &str) -> Option<(&str, i32)> {
    let end = symbol.find(|c: char| c.is_ascii_digit() || "²³^½".contains(c)).filter(|end| *end > 0);
    let Some(end) = end else { return Some((symbol, 1)) };
    let power = match &symbol[end..] {
        "²" => 2,
        "³" => 3,
        digits => digits.parse().ok()?,
    };
    Some((&symbol[..end], power))
}

/// Exponents of a symbol.
fn base(symbol: &str) -> Option<[i32; 6]> {
    Some(match symbol {
        "1" => [0; 6],
        "kg" => [1, 0, 0, 0, 0, 0],
        "m" => [0, 1, 0, 0, 0, 0],
        "s" => [0, 0, 1, 0, 0, 0],
        "A" => [0, 0, 0, 1, 0, 0],
        "K" => [0, 0, 0, 0, 1, 0],
        "rad" => [0, 0, 0, 0, 0, 1],
        "Hz" => [0, 0, -1, 0, 0, 0],
        "N" => [1, 1, -2, 0, 0, 0],
        "V" => [1, 2, -3, -1, 0, 0],
        "ohm" | "Ω" => [1, 2, -3, -2, 0, 0],
        "H" => [1, 2, -2, -2, 0, 0],
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use greyrig::effects::Description;
    use greyrig::motor::{BaseParameter, FluxLaw};

    use super::*;

    fn of(unit: &str) -> [i32; 6] {
        Exponents::parse(unit).unwrap_or_else(|| panic!("{unit}")).of
    }

    #[test]
    fn units_are_what_the_si_says() {
        // By the energy in a coil, L i²/2, and the power in a resistor: kg m²/s² by A², and by s.
        assert_eq!(of("H"), of("kg m2/(s2 A2)"));
        assert_eq!(of("ohm"), of("H/s"));
        assert_eq!(of("V s/(rad A)"), [1, 2, -2, -2, 0, -1]);
        assert_eq!(of("N m s²/rad²"), of("N m s2/rad2"));
        assert_eq!(of("1/A²"), [0, 0, 0, -2, 0, 0]);
        assert_eq!((of("1"), of("Hz"), of("1/s")), ([0; 6], [0, 0, -1, 0, 0, 0], [0, 0, -1, 0, 0, 0]));
        for none in ["A^½ rad/s", "furlong", "N (m", "V/(s"] {
            assert_eq!(Exponents::parse(none), None, "{none}");
        }
    }

    #[test]
    fn all_units_of_models_are_known() {
        let base = BaseParameter::ALL
            .into_iter()
            .flat_map(|p| [FluxLaw::Series, FluxLaw::PermanentMagnet].map(|law| p.unit(law)));
        let effects = Description::all().flat_map(|d| d.parameters).map(|p| p.unit);
        for unit in base.chain(effects).filter(|unit| !unit.contains('½')) {
            of(unit);
        }
    }
}

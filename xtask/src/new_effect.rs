//! `cargo xtask new-effect NAME`: the beginning of an effect: its file, its line in the catalogue, its test, and its
//! page. It compiles as it is made, with a law that stands in for the one to be written.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Files that get a line.
const CATALOGUE: &str = "src/effects/mod.rs";
const TESTS: &str = "tests/core/main.rs";
const SUMMARY: &str = "docs/SUMMARY.md";

/// Makes it in the repository in a folder, and returns the files that are new or changed.
///
/// # Errors
/// A name that is none of an effect, or is taken; files that do not look as they should, or cannot be written. Nothing
/// is written then.
pub fn make(root: &Path, name: &str) -> Result<Vec<PathBuf>, String> {
    let is_name = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && !name.ends_with('_')
        && !name.contains("__");
    if !is_name {
        return Err(format!("`{name}` cannot name an effect; write it like gear_backlash"));
    }
    let file = format!("src/effects/{name}.rs");
    if root.join(&file).exists() {
        return Err(format!("{file} is there already; choose another name"));
    }
    let (camel, words) = (camel(name), name.replace('_', " "));
    let filled = |template: &str| template.replace("{name}", name).replace("{Name}", &camel).replace("{words}", &words);
    let page = format!("docs/effects/{name}.md");
    // What is known of the motor comes before what its channels show.
    let catalogue = with_line(root, CATALOGUE, &format!("    {name}::{camel},"), |line| {
        line.trim() == "current_compression::CurrentCompression,"
    })?;
    // In the order of names.
    let tests = with_line(root, TESTS, &format!("mod {name};"), |line| {
        line.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')).is_some_and(|other| other > name)
    })?;
    let line = format!("  - [{}](effects/{name}.md)", capitalised(&words));
    let summary = with_line(root, SUMMARY, &line, |line| line.ends_with("(effects/current_compression.md)"))?;
    let made = [
        (file, filled(EFFECT)),
        (format!("tests/core/{name}.rs"), filled(TEST)),
        (page, filled(PAGE)),
        (CATALOGUE.to_owned(), catalogue),
        (TESTS.to_owned(), tests),
        (SUMMARY.to_owned(), summary),
    ];
    for (path, text) in &made {
        std::fs::write(root.join(path), text).map_err(|error| format!("{path} cannot be written: {error}"))?;
    }
    Ok(made.into_iter().map(|(path, _)| PathBuf::from(path)).collect())
}

/// What was made, and what comes next.
pub fn told(name: &str, made: &[PathBuf]) -> String {
    let mut text = String::new();
    for path in made {
        let _ = writeln!(text, "{}", path.display());
    }
    text + &format!(
        "\nNow: the law and its words in src/effects/{name}.rs, its formula by hand in tests/core/{name}.rs. Then\n  \
         cargo test --release --test core\n  cargo greyrig effects --book docs/effects --force\n  \
         cargo greyrig effects --markdown > docs/effects.md\n"
    )
}

/// A file with a line more, before the first one that it has to stand before.
fn with_line(root: &Path, path: &str, line: &str, before: impl Fn(&str) -> bool) -> Result<String, String> {
    let text = std::fs::read_to_string(root.join(path)).map_err(|error| format!("{path} cannot be read: {error}"))?;
    let mut lines: Vec<&str> = text.lines().collect();
    let place = lines.iter().position(|line| before(line));
    let place = place.ok_or_else(|| format!("{path} has no place for `{}`", line.trim()))?;
    lines.insert(place, line);
    Ok(lines.join("\n") + "\n")
}

/// `gear_backlash` as a type: `GearBacklash`.
fn camel(name: &str) -> String {
    name.split('_').map(capitalised).collect()
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The effect's file: a voltage that grows with the square of the current.
const EFFECT: &str = r#"//! TODO what it is, in a sentence.
//!
//! `u = … + k i |i|`, k in V/A². TODO the law, with its symbols and units.
//!
//! Source: TODO.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// TODO what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct {Name}<S> {
    /// k, V/A².
    pub coefficient: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for {Name}<S> {
    const DESCRIPTION: Description = Description {
        name: "{words}",
        equation: "u = … + k i |i|",
        acts: Acts::Electrical,
        parameters: &[EffectParameter {
            name: "{name}",
            unit: "V/A²",
            role: Role::Size,
            range: (-1e4, 1e4),
            start: 0.01,
            relative: Relative::Absolute,
            meaning: "TODO what the parameter is",
        }],
        size_in_words: "TODO a sentence with {} for the size",
        excited_by: &[Excitation::Current],
        prior: Prior::rare("TODO on how many rigs it is to be expected, and why"),
        why: "TODO why it bends the curves.",
        noticed: "TODO what one would see and hear.",
        remedy: "TODO what to do about it.",
        signature: "TODO what a model without it leaves in the residual",
        confused_with: &[EffectId::BrushDrop],
        separated_by: &[Separation::by("TODO the recording that tells it from these")],
        source: "TODO",
        ..Description::usual(EffectId::{Name})
    };
    fields!(coefficient);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.voltage += at.current.times(self.coefficient) * at.current.abs();
    }
}
"#;

/// Its test, against a formula that is worked out beside it.
const TEST: &str = r#"//! `{name}` against its law, worked out by hand.

use greyrig::effects::{Effect, EffectId};
use greyrig::motor::{Constraints, FluxLaw, Motor, Parameters, Stepper};

#[test]
fn a_held_rotor_takes_the_current_of_the_law() {
    let parameters = Parameters::from_values(FluxLaw::PermanentMagnet, [3.0, 0.01, 0.05, 1e-5, 0.0, 4e-5, 0.0]);
    let motor = Motor::build(parameters, &[Effect::new(EffectId::{Name}, &[0.5])]).expect("a motor");
    let mut stepper = Stepper::build(motor, 1e-4).expect("slower than the sampling");
    (0..20_000).for_each(|_| _ = stepper.step(24.0, 24.0, Constraints::ROTOR_LOCKED));
    // 3 i + 0.5 i² = 24: i = (−3 + √(9 + 48))/1.
    let by_hand = -3.0 + 57f64.sqrt();
    assert!((stepper.reading().current - by_hand).abs() < 1e-9 * by_hand, "{}", stepper.reading().current);
}
"#;

/// Its page until the command makes it.
const PAGE: &str = "# {words}\n\n`cargo greyrig effects --book docs/effects --force` makes this page.\n";

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// The repository, without some folders.
    fn copy(from: &Path, to: &Path, without: &[PathBuf]) {
        std::fs::create_dir_all(to).expect("a folder");
        for entry in std::fs::read_dir(from).expect("a folder") {
            let path = entry.expect("an entry").path();
            let copied = to.join(path.file_name().expect("a name"));
            if without.contains(&path) {
                continue;
            }
            if path.is_dir() {
                copy(&path, &copied, without);
            } else {
                std::fs::copy(&path, copied).expect("a copy");
            }
        }
    }

    #[test]
    fn what_is_made_compiles_and_is_formatted() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let folder = std::env::temp_dir().join(format!("greyrig-new-effect-{}", std::process::id()));
        let made_of_it = [".git", "target", "book", "host-tools/web/node_modules"].map(|name| root.join(name));
        copy(&root, &folder, &made_of_it);
        let made = make(&folder, "gear_backlash").expect("it is made");
        let again = make(&folder, "gear_backlash").expect_err("it is there");
        // A folder of the copy's own below that of the tests, kept from run to run: what it depends on is built once.
        let target = std::env::current_exe().expect("this test").ancestors().nth(3).expect("target").join("new-effect");
        let cargo = |arguments: &[&str]| {
            let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
            command.args(arguments).current_dir(&folder).env("CARGO_TARGET_DIR", &target);
            let output = command.output().expect("cargo runs");
            (output.status.success(), String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
        };
        let checked = cargo(&["check", "--quiet", "--package", "greyrig", "--lib", "--locked"]);
        let formatted = cargo(&["fmt", "--check", "--package", "greyrig"]);
        std::fs::remove_dir_all(&folder).expect("the folder goes");
        assert!(made.contains(&PathBuf::from("docs/effects/gear_backlash.md")), "{made:?}");
        assert!(again.contains("there already"), "{again}");
        assert!(checked.0, "{}", checked.1);
        assert!(formatted.0, "{}", formatted.1);
    }

    #[test]
    fn names_are_those_of_effects() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for wrong in ["", "Gear", "gear-backlash", "gear__backlash", "gear_", "1st", "../x"] {
            assert!(make(&root, wrong).is_err_and(|said| said.contains("cannot name an effect")), "{wrong}");
        }
        assert!(make(&root, "saturation").is_err_and(|said| said.contains("there already")));
        assert_eq!(camel("gear_backlash"), "GearBacklash");
    }
}

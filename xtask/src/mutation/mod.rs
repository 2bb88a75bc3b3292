//! `cargo xtask mutants`: changes the code, one place at a time, and looks which change no test notices.
//!
//! What can be changed is what cargo-mutants finds; which files, stands in `.cargo/mutants.toml`; what survives for a
//! reason, in `docs/mutants.md`. cargo-mutants builds each change anew, and a build of the host takes a minute. Here
//! all changes of a package are built at once, each behind a switch, in a copy of the repository ([`copy`],
//! [`switch`]); then each runs the tests that reach it ([`reach`]), the quick ones first.

mod changes;
mod copy;
mod outcome;
mod reach;
mod switch;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::needs::{self, Need};
use changes::Change;
use outcome::{Counts, Outcome};

/// A package, and which of its tests are to notice: those that call what is changed themselves.
pub struct Part {
    /// Name of the package.
    package: &'static str,
    /// Its folder.
    folder: &'static str,
    /// What Cargo is to build.
    tests: &'static [&'static str],
}

const PARTS: [Part; 2] = [
    Part { package: "greyrig", folder: ".", tests: &["--lib", "--test", "core"] },
    Part { package: "greyrig-host", folder: "host-tools", tests: &["--lib", "--features", "full"] },
];

/// What is wanted.
#[derive(Debug, Default, PartialEq)]
struct Wanted {
    package: Option<String>,
    /// Parts of paths; none: all files.
    files: Vec<String>,
    /// The k-th of n parts, k from 0.
    shard: Option<(usize, usize)>,
    /// Only what the run before did not notice.
    again: bool,
    output: Option<PathBuf>,
}

impl Wanted {
    fn parse(arguments: &[String]) -> Result<Self, String> {
        let mut wanted = Self::default();
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
            match argument.as_str() {
                "--file" => wanted.files.push(value()?.clone()),
                "--shard" => wanted.shard = Some(shard(value()?)?),
                "--output" => wanted.output = Some(std::path::absolute(value()?).map_err(|error| error.to_string())?),
                "--again" => wanted.again = true,
                name if PARTS.iter().any(|part| part.package == name) => wanted.package = Some(name.to_owned()),
                other => {
                    return Err(format!(
                        "{other}: what is known is greyrig, greyrig-host, --file PART-OF-PATH, --shard K/N, --again, \
                         --output DIR"
                    ));
                }
            }
        }
        Ok(wanted)
    }

    fn wants(&self, number: usize, change: &Change) -> bool {
        (self.files.is_empty() || self.files.iter().any(|part| change.file.contains(part)))
            && self.shard.is_none_or(|(k, n)| number % n == k)
    }
}

/// K/N, K from 0 to N − 1.
fn shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
    numbers.filter(|(k, n)| k < n).ok_or(format!("--shard {text}: K/N is wanted, K from 0 to N − 1"))
}

/// Changes both packages, or the one that is named.
///
/// # Errors
/// A change that no test noticed and that `docs/mutants.md` does not list, or what could not be built or run.
pub fn run(arguments: &[String]) -> Result<(), String> {
    let wanted = Wanted::parse(arguments)?;
    needs::provide([Need::Mutants].iter())?;
    let mut unexplained = 0;
    for part in PARTS.iter().filter(|part| wanted.package.as_ref().is_none_or(|name| name == part.package)) {
        unexplained += examine(part, &wanted)?;
    }
    match unexplained {
        0 => Ok(()),
        n => Err(format!("{n} changes that no test notices; each takes a test, or its reason in docs/mutants.md")),
    }
}

/// How many changes of a package nobody noticed, without those of which that is known.
fn examine(part: &Part, wanted: &Wanted) -> Result<usize, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let output = wanted.output.clone().unwrap_or_else(|| root.join("target/mutants"));
    let all = changes::list(part.package)?;
    let listed = outcome::listed(&root)?;
    let file = output.join(format!("{}.txt", part.package));
    let mut known = outcome::read(&file);
    let is_wanted = |number: usize, change: &Change, name: &str| {
        wanted.wants(number, change) && (!wanted.again || known.get(name) == Some(&Outcome::Missed))
    };
    let names = changes::names(&all);
    let numbered = all.into_iter().zip(names).enumerate();
    let chosen = numbered.filter(|(number, (change, name))| is_wanted(*number, change, name));
    // Only what is tried is built: a switch at each operator of the stepper makes minutes of seconds.
    let (changes, names): (Vec<Change>, Vec<String>) = chosen.map(|(_, both)| both).unzip();
    // Of each package one, so that neither is built anew for the other.
    let tree = output.join(part.package);
    let built = copy::build(part, &changes, &root, &tree)?;
    let placed = built.places.iter().filter(|place| place.is_some()).count();
    println!("{}: {} changes, {placed} of them built behind a switch", part.package, changes.len());

    let reach = reach::measure(&built.programs, &tree.join(part.folder), &output.join("reached"))?;
    let mut counts: BTreeMap<&str, Counts> = BTreeMap::new();
    let mut unexplained = 0;
    let begin = Instant::now();
    for (number, change) in changes.iter().enumerate() {
        let name = &names[number];
        let outcome = match built.places[number] {
            None => Outcome::NotBuilt,
            Some(place) => reach.try_change(number, place)?,
        };
        counts.entry(&change.file).or_default().add(outcome, listed.contains(name));
        if outcome == Outcome::Missed && !listed.contains(name) {
            unexplained += 1;
            let place = format!("{}:{}", change.span.start.line, change.span.start.column);
            println!("{:6.0} s  missed: {name}   at {place}", begin.elapsed().as_secs_f64());
        }
        // At once: whoever ends this has what was found so far.
        known.insert(name.clone(), outcome);
        outcome::write(&file, &known)?;
    }
    print!("{}", outcome::table(&counts));
    Ok(unexplained)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_name_a_package_files_and_a_part() {
        let parse = |line: &str| Wanted::parse(&line.split_whitespace().map(str::to_owned).collect::<Vec<_>>());
        let wanted = parse("greyrig --file detector --shard 2/5 --again").unwrap();
        assert_eq!(wanted.package.as_deref(), Some("greyrig"));
        assert_eq!((wanted.shard, wanted.again), (Some((2, 5)), true));
        assert!(parse("--shard 5/5").is_err() && parse("--shard x").is_err() && parse("--shard").is_err());
        assert!(parse("core").is_err());
    }
}

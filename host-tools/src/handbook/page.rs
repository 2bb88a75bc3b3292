//! An effect's page.

use greyrig::effects::{Description, EffectId, InWords, Sentence};
use greyrig::motor::FluxLaw;

use super::difference::Difference;
use super::{run, words};
use crate::diagnose::classes;
use crate::model::Kind;
use crate::numbers;

/// The page, as Markdown.
pub fn page(d: &Description, difference: Option<&Difference>) -> String {
    let mut text = format!(
        "# {}\n\n`{}` enters {}. `greyrig diagnose` tries it {}. It shows {}.\n",
        words::capitalised(d.name),
        d.id,
        balances(d),
        words::tried(d),
        words::shows(d)
    );
    text += &format!("\n## Why it bends the curves\n\n{}\n", d.why);
    if let Some(it) = difference {
        text += &format!("\n![Current and speed of a motor without and with {0}]({1}.svg)\n\n", d.name, d.id);
        text += &format!("*{}*\n\n```console\n$ {}\n```\n", caption(it), it.command);
    }
    text += &format!("\n## What one would see and hear\n\n{}\n\n", d.noticed);
    text += &format!("A model without it leaves: {}.\n", d.signature);
    text += &format!("\n## How large it is\n\n{}\n", sizes(d));
    text += &format!("\n## What looks like it\n\n{}\n", alike(d));
    text += &format!("\n## What to do about it\n\n{}\n", d.remedy);
    if !words::diagnosed_in(d).is_empty() {
        text += &format!(
            "\n```console\n$ greyrig diagnose run.csv --model model.toml\n$ greyrig add {} --model model.toml run.csv \
             other.csv --out model2.toml\n```\n",
            d.id
        );
    }
    text += &format!("\n## How it is modelled\n\n```text\n{}\n```\n\n{}", d.equation, parameters(d));
    text += &format!("\nSource: {}. Every effect in one table: [the catalogue](../effects.md).\n", d.source);
    text
}

/// Which balance an effect enters, as the end of a sentence.
fn balances(d: &Description) -> String {
    match words::enters(d) {
        "measuring chain" => "the measuring chain".to_owned(),
        "voltage and torque" => "the voltage and the torque balance".to_owned(),
        one => format!("the {one} balance"),
    }
}

/// What the figure shows, in figures.
fn caption(it: &Difference) -> String {
    let parts: Vec<String> =
        it.moved.iter().map(|moved| format!("the {} by {}", moved.name, share(moved.relative))).collect();
    format!("It moves {}: RMS of the difference over RMS without it, of the whole run.", parts.join(", "))
}

/// A ratio in per cent, two digits; below what the figure could show, as that.
fn share(ratio: f64) -> String {
    if ratio < 5e-5 { "less than 0.01 %".to_owned() } else { format!("{} %", numbers::figure(100.0 * ratio, 2)) }
}

/// Sizes in plain words: what the size means, what is usual on the rig, on how many rigs it is seen.
fn sizes(d: &Description) -> String {
    let size = format!("`{}`", d.size().name);
    let mut text = format!("In words: {}.", Sentence(d.size_in_words, size));
    if let Some(effect) = run::on_the_rig(d) {
        let unit = if effect.unit.is_empty() { String::new() } else { format!(" {}", effect.unit) };
        text += &format!("\n\nSizes on the virtual rig ({}):\n\n", effect.size);
        text += "| motor | usual | from | to |\n| --- | --- | --- | --- |\n";
        for (kind, motor) in [(Kind::Universal, "1.4 kW, 230 V, universal"), (Kind::PmDc, "24 V, magnets")] {
            if let Some(sizes) = effect.sizes(kind) {
                let [usual, least, most] = [sizes.default, sizes.least, sizes.most].map(|v| format!("{v}{unit}"));
                text += &format!("| {motor} | {usual} | {least} | {most} |\n");
            }
        }
    }
    let expected = words::capitalised(&format!("it is to be expected {}", words::prior(d)));
    format!("{}\n\n{expected}. That share is a judgement, not a count.", text.trim_end())
}

/// What looks like it, what stands for it, and which recording tells.
fn alike(d: &Description) -> String {
    let links = |ids: &[EffectId]| ids.iter().map(|id| format!("[`{id}`]({id}.md)")).collect::<Vec<_>>().join(", ");
    let mut text = String::new();
    if !d.confused_with.is_empty() {
        text += &format!("- It is confused with {}.\n", links(d.confused_with));
    }
    for class in classes::all().iter().filter(|class| class.members.contains(&d.id)) {
        let motors = match class.law {
            None => "",
            Some(FluxLaw::Series) => " in series motors",
            Some(FluxLaw::PermanentMagnet) => " in motors with magnets",
        };
        text += &format!(
            "- No recording of voltage, current and speed tells these apart{motors}: {}. The first one is named for all.\n",
            links(&class.members)
        );
    }
    if let Some((other, beyond)) = words::turns_into(d) {
        text += &format!("- It turns into {} with {beyond}.\n", links(&[other]));
    }
    text += &format!("- A recording shows it that holds {}.\n", words::excited_by(d));
    if !d.separated_by.is_empty() {
        text += &format!("- It is told apart by {}.\n", InWords(d.separated_by));
    }
    text.trim_end().to_owned()
}

fn parameters(d: &Description) -> String {
    let mut text =
        String::from("| parameter | unit | meaning | range | a fit starts at |\n| --- | --- | --- | --- | --- |\n");
    for p in d.parameters {
        text += &format!(
            "| `{}` | {} | {} | {} … {} | {}{} |\n",
            p.name,
            p.unit,
            p.meaning,
            p.range.0,
            p.range.1,
            p.start,
            words::relative(p.relative)
        );
    }
    text
}

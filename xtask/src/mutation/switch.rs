//! One file with all its changes, each behind a switch.
//!
//! An expression with changes becomes a `match` of the number that is switched on: an arm for each change, which holds
//! the changed text, and one for all other numbers, in which the expressions within have switches of their own. What a
//! function gives back is changed by a `return` ahead of it. In constants there are no switches: they are computed
//! when the tests are built.

use std::collections::BTreeMap;
use std::ops::Range;

use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Block, Expr, Signature, Stmt};

use super::changes::{Change, Position};

/// The number that is switched on, from the environment.
pub const VARIABLE: &str = "GREYRIG_MUTANT";
/// Where this is set nothing is switched on; each place that is reached goes to the file of this name, a line each.
pub const REACHED: &str = "GREYRIG_MUTANT_REACHED";

/// What the library gets besides.
const MODULE: &str = r#"
#[doc(hidden)]
pub mod mutation_switch {
    extern crate std;
    use std::{cell::RefCell, collections::BTreeSet, env, format, fs::File, io::Write, sync::OnceLock};

    static ACTIVE: OnceLock<u32> = OnceLock::new();

    // Copies of it would make the code many times as large.
    #[inline(never)]
    pub fn at(place: u32) -> u32 {
        let active = *ACTIVE.get_or_init(active);
        if active == u32::MAX {
            reached(place);
        }
        active
    }

    fn active() -> u32 {
        let number = || env::var("GREYRIG_MUTANT").ok()?.parse().ok();
        if env::var_os("GREYRIG_MUTANT_REACHED").is_some() { u32::MAX } else { number().unwrap_or(0) }
    }

    #[cold]
    fn reached(place: u32) {
        static FILE: OnceLock<Option<File>> = OnceLock::new();
        std::thread_local! { static SEEN: RefCell<BTreeSet<u32>> = const { RefCell::new(BTreeSet::new()) }; }
        let open = || File::options().append(true).create(true).open(env::var_os("GREYRIG_MUTANT_REACHED")?).ok();
        if SEEN.try_with(|seen| seen.borrow_mut().insert(place)).unwrap_or(true) {
            FILE.get_or_init(open).as_ref().map(|mut file| file.write_all(format!("{place}\n").as_bytes()));
        }
    }
}
"#;

/// The library with the module of the switch; lints that a change may break are off.
pub fn library(text: &str) -> String {
    format!("#![allow(warnings, arithmetic_overflow, unconditional_panic, unused_comparisons)]\n{text}{MODULE}")
}

/// A change in the new text.
pub struct Placed {
    /// Number of the change.
    pub change: usize,
    /// Number of the place: what is told when it is reached.
    pub place: usize,
    /// Where its arm is.
    arm: Range<usize>,
    /// Where the whole switch is.
    whole: Range<usize>,
}

/// A file with switches.
pub struct Switched {
    pub text: String,
    pub placed: Vec<Placed>,
}

impl Switched {
    /// The changes that an error at this byte is about: one, or all that stand behind a switch.
    pub fn at(&self, byte: usize) -> Vec<usize> {
        let arm = self.placed.iter().filter(|p| p.arm.contains(&byte)).min_by_key(|p| p.arm.len());
        let whole = self.placed.iter().filter(|p| p.whole.contains(&byte)).map(|p| p.whole.len()).min();
        match (arm, whole) {
            (Some(arm), Some(whole)) if arm.arm.len() <= whole => vec![arm.change],
            (_, Some(whole)) => {
                let of = |p: &&Placed| p.whole.contains(&byte) && p.whole.len() == whole;
                self.placed.iter().filter(of).map(|p| p.change).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// A place of the source with changes: an expression, or the begin of a function's body, whose range is empty.
struct Place {
    range: Range<usize>,
    /// A statement of its own needs no parentheses, and bears none.
    statement: bool,
    /// Number and text.
    arms: Vec<(usize, String)>,
}

/// Puts changes behind switches; those in constants are left out.
///
/// # Errors
/// Where the source is not Rust.
pub fn file(source: &str, changes: Vec<(usize, &Change)>) -> Result<Switched, String> {
    let lines: Vec<usize> = std::iter::once(0).chain(source.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let offset = |position: Position| {
        let line = lines.get(position.line - 1).copied().unwrap_or(source.len());
        let column = source[line..].char_indices().nth(position.column - 1);
        column.map_or(source.len(), |(at, _)| line + at)
    };
    let mut finder =
        Finder { source, changes: BTreeMap::new(), places: BTreeMap::new(), constants: 0, statement: None };
    for (number, change) in changes {
        let range = offset(change.span.start)..offset(change.span.end);
        finder.changes.entry(range.start).or_default().push((number, range, change));
    }
    let syntax = syn::parse_file(source).map_err(|error| error.to_string())?;
    finder.visit_file(&syntax);
    // What begins at the same byte as a function's body stands behind its switch; the larger expression is the outer.
    let mut places: Vec<Place> = finder.places.into_values().collect();
    places.sort_by_key(|p| (p.range.start, !p.range.is_empty(), std::cmp::Reverse(p.range.end)));
    let mut result = Switched { text: String::new(), placed: Vec::new() };
    render(source, 0..source.len(), &places, &mut result);
    Ok(result)
}

fn render(source: &str, range: Range<usize>, places: &[Place], to: &mut Switched) {
    let mut at = range.start;
    let mut rest = places;
    while let Some((place, others)) = rest.split_first() {
        to.text.push_str(&source[at..place.range.start]);
        let within = others.iter().take_while(|p| p.range.end <= place.range.end && !place.range.is_empty()).count();
        // A number of zero is none.
        let number = place.arms[0].0 + 1;
        let (begin, first) = (to.text.len(), to.placed.len());
        let of_body = place.range.is_empty();
        to.text.push_str(if place.statement { "" } else { "(" });
        to.text.push_str(&format!("match crate::mutation_switch::at({number}) {{\n"));
        for (change, text) in &place.arms {
            let from = to.text.len();
            let arm = if of_body { format!("return {text}") } else { format!("({text})") };
            to.text.push_str(&format!("{} => {arm},\n", change + 1));
            to.placed.push(Placed { change: *change, place: number, arm: from..to.text.len(), whole: 0..0 });
        }
        let own = first..to.placed.len();
        if of_body {
            to.text.push_str("_ => {}\n}\n");
        } else {
            to.text.push_str("_ => (");
            render(source, place.range.clone(), &others[..within], to);
            to.text.push_str(")\n}");
            to.text.push_str(if place.statement { "\n" } else { ")" });
        }
        let whole = begin..to.text.len();
        to.placed[own].iter_mut().for_each(|placed| placed.whole = whole.clone());
        at = place.range.end;
        rest = &others[within..];
    }
    to.text.push_str(&source[at..range.end]);
}

/// A change, its number, and the bytes that it is of.
type Numbered<'a> = (usize, Range<usize>, &'a Change);

struct Finder<'a> {
    source: &'a str,
    /// By the byte that they begin with.
    changes: BTreeMap<usize, Vec<Numbered<'a>>>,
    places: BTreeMap<(usize, usize), Place>,
    /// Constants around.
    constants: usize,
    /// The expression that is a statement of its own.
    statement: Option<Range<usize>>,
}

impl Finder<'_> {
    /// Puts the changes of a sort that begin at a byte into an expression.
    fn take(&mut self, genre: &str, begin: usize, whole: Range<usize>) {
        if self.constants > 0 {
            return;
        }
        let source = self.source;
        for (number, range, change) in self.changes.get(&begin).into_iter().flatten() {
            if change.genre == genre && whole.start <= range.start && range.end <= whole.end {
                let text = [&source[whole.start..range.start], &change.replacement, &source[range.end..whole.end]];
                let statement = self.statement.as_ref() == Some(&whole);
                let place = || Place { range: whole.clone(), statement, arms: Vec::new() };
                let place = self.places.entry((whole.start, whole.end)).or_insert_with(place);
                place.arms.push((*number, text.concat()));
            }
        }
    }

    fn function(&mut self, signature: &Signature, block: &Block) {
        // A type that is told by the body alone cannot be another one ahead of it.
        let of_body = self.source[signature.output.span().byte_range()].contains("impl ");
        let may_be = !of_body && signature.constness.is_none() && self.constants == 0;
        let Some(first) = block.stmts.first().filter(|_| may_be) else { return };
        let (begin, end) = (block.brace_token.span.open().byte_range().end, first.span().byte_range().start);
        let of = self.changes.range(begin..=end).flat_map(|(_, changes)| changes);
        let of = of.filter(|(_, _, change)| change.genre == "FnValue");
        let arms: Vec<_> = of.map(|(number, _, change)| (*number, change.replacement.clone())).collect();
        if !arms.is_empty() {
            self.places.insert((begin, begin), Place { range: begin..begin, statement: true, arms });
        }
    }

    fn within_constant(&mut self, visit: impl FnOnce(&mut Self)) {
        self.constants += 1;
        visit(self);
        self.constants -= 1;
    }
}

/// Whether a chain of conditions binds names: its parts cannot stand in parentheses.
fn binds(expression: &Expr) -> bool {
    match expression {
        Expr::Let(_) => true,
        Expr::Binary(both) => binds(&both.left) || binds(&both.right),
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_expr_binary(&mut self, expression: &'ast syn::ExprBinary) {
        if !binds(&expression.left) && !binds(&expression.right) {
            let begin = expression.op.span().byte_range().start;
            self.take("BinaryOperator", begin, expression.span().byte_range());
        }
        visit::visit_expr_binary(self, expression);
    }

    fn visit_expr_unary(&mut self, expression: &'ast syn::ExprUnary) {
        let begin = expression.op.span().byte_range().start;
        self.take("UnaryOperator", begin, expression.span().byte_range());
        visit::visit_expr_unary(self, expression);
    }

    fn visit_expr_match(&mut self, expression: &'ast syn::ExprMatch) {
        let whole = expression.span().byte_range();
        for arm in &expression.arms {
            self.take("MatchArm", arm.span().byte_range().start, whole.clone());
            if let Some((_, guard)) = arm.guard.as_ref().filter(|(_, guard)| !binds(guard)) {
                let guard = guard.span().byte_range();
                self.take("MatchArmGuard", guard.start, guard);
            }
        }
        visit::visit_expr_match(self, expression);
    }

    fn visit_expr_struct(&mut self, expression: &'ast syn::ExprStruct) {
        for field in &expression.fields {
            self.take("StructField", field.span().byte_range().start, expression.span().byte_range());
        }
        visit::visit_expr_struct(self, expression);
    }

    fn visit_stmt(&mut self, statement: &'ast Stmt) {
        if let Stmt::Expr(expression, None) = statement {
            self.statement = Some(expression.span().byte_range());
        }
        visit::visit_stmt(self, statement);
    }

    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.function(&function.sig, &function.block);
        match function.sig.constness {
            Some(_) => self.within_constant(|finder| visit::visit_item_fn(finder, function)),
            None => visit::visit_item_fn(self, function),
        }
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.function(&function.sig, &function.block);
        match function.sig.constness {
            Some(_) => self.within_constant(|finder| visit::visit_impl_item_fn(finder, function)),
            None => visit::visit_impl_item_fn(self, function),
        }
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        if let Some(block) = &function.default {
            self.function(&function.sig, block);
        }
        visit::visit_trait_item_fn(self, function);
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        self.within_constant(|finder| visit::visit_item_const(finder, item));
    }

    fn visit_item_static(&mut self, item: &'ast syn::ItemStatic) {
        self.within_constant(|finder| visit::visit_item_static(finder, item));
    }

    fn visit_impl_item_const(&mut self, item: &'ast syn::ImplItemConst) {
        self.within_constant(|finder| visit::visit_impl_item_const(finder, item));
    }

    fn visit_trait_item_const(&mut self, item: &'ast syn::TraitItemConst) {
        self.within_constant(|finder| visit::visit_trait_item_const(finder, item));
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.within_constant(|finder| visit::visit_item_enum(finder, item));
    }

    fn visit_type(&mut self, item: &'ast syn::Type) {
        self.within_constant(|finder| visit::visit_type(finder, item));
    }

    fn visit_pat(&mut self, pattern: &'ast syn::Pat) {
        self.within_constant(|finder| visit::visit_pat(finder, pattern));
    }

    fn visit_expr_repeat(&mut self, expression: &'ast syn::ExprRepeat) {
        self.visit_expr(&expression.expr);
        self.within_constant(|finder| finder.visit_expr(&expression.len));
    }

    fn visit_generic_argument(&mut self, argument: &'ast syn::GenericArgument) {
        self.within_constant(|finder| visit::visit_generic_argument(finder, argument));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mutation::changes::Span;

    fn change(genre: &str, from: (usize, usize), to: (usize, usize), replacement: &str) -> Change {
        let position = |(line, column)| Position { line, column };
        let span = Span { start: position(from), end: position(to) };
        Change::of("src/a.rs", genre, replacement, span)
    }

    /// The places of a line are those of its characters, not bytes.
    #[test]
    fn an_operator_becomes_a_switch_and_constants_do_not() {
        let source = "fn f(é: u8) -> u8 { é + 1 * 2 }\nconst A: u8 = 1 + 2;\n";
        let changes = [
            change("BinaryOperator", (1, 23), (1, 24), "-"),
            change("BinaryOperator", (1, 27), (1, 28), "/"),
            change("FnValue", (1, 21), (1, 30), "0"),
            change("BinaryOperator", (2, 17), (2, 18), "-"),
        ];
        let result = file(source, changes.iter().enumerate().collect()).unwrap();
        for text in ["1 => (é - 1 * 2),", "2 => (1 / 2),", "3 => return 0,", "const A: u8 = 1 + 2;"] {
            assert!(result.text.contains(text), "{text}: {}", result.text);
        }
        syn::parse_file(&result.text).unwrap();
        let mut placed: Vec<(usize, usize)> = result.placed.iter().map(|p| (p.change, p.place)).collect();
        placed.sort_unstable();
        assert_eq!(placed, [(0, 1), (1, 2), (2, 3)]);
        // An error in an arm is about its change; one of the switch about all of it.
        assert_eq!(result.at(result.text.find("1 / 2").unwrap()), [1]);
        assert_eq!(result.at(result.text.find("match crate::mutation_switch::at(2)").unwrap()), [1]);
        assert!(result.at(0).is_empty());
    }

    #[test]
    fn conditions_that_bind_names_stay_as_they_are() {
        let source = "fn f(a: Option<u8>) -> bool {\n    if let Some(x) = a && x < 3 { true } else { false }\n}\n";
        let changes =
            [change("BinaryOperator", (2, 24), (2, 26), "||"), change("BinaryOperator", (2, 29), (2, 30), ">")];
        let result = file(source, changes.iter().enumerate().collect()).unwrap();
        assert_eq!(result.placed.iter().map(|p| p.change).collect::<Vec<_>>(), [1]);
        syn::parse_file(&result.text).unwrap();
    }
}

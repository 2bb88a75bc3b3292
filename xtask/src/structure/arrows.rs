//! Who names what of whom.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Item, ItemMod, ItemUse, Macro, Path, VisRestricted};

use super::tree::{Named, Names, Tree, attributes_of, is_test, leaves};

/// An arrow from a file to another one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrow {
    /// The file that names something.
    pub from: usize,
    /// The file that defines it.
    pub to: usize,
    /// What it names.
    pub names: BTreeSet<String>,
}

impl Arrow {
    /// As a line.
    pub fn shown(&self, tree: &Tree) -> String {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        format!("{} -> {}: {}", tree.files[self.from].path, tree.files[self.to].path, names.join(", "))
    }
}

/// All arrows of a crate but those from a module down to its own parts.
pub fn of(tree: &Tree) -> Vec<Arrow> {
    let mut arrows: BTreeMap<(usize, usize), BTreeSet<String>> = BTreeMap::new();
    for (from, file) in tree.files.iter().enumerate() {
        let mut reader = Reader { tree, module: file.module.clone(), named: Vec::new() };
        reader.items(&file.syntax.items);
        for (to, name) in reader.named {
            if to != from && !tree.files[to].module.starts_with(&file.module) {
                arrows.entry((from, to)).or_default().insert(name);
            }
        }
    }
    arrows.into_iter().map(|((from, to), names)| Arrow { from, to, names }).collect()
}

struct Reader<'a> {
    tree: &'a Tree,
    /// The module that is being read.
    module: Names,
    /// What is named: the file that defines it, and its name.
    named: Vec<(usize, String)>,
}

impl Reader<'_> {
    fn items(&mut self, items: &[Item]) {
        items.iter().for_each(|item| self.visit_item(item));
    }

    /// Takes up a path as it is written. One that begins with another crate's name leads nowhere.
    fn path(&mut self, path: &[String]) {
        match self.tree.find(&self.tree.absolute(&self.module, path)) {
            Some(Named::Item(file, name)) => self.named.push((file, name)),
            // By itself a module is only a way to what it holds; that it is taken by a name counts where something is
            // asked of it.
            Some(Named::Module(_)) | None => {}
        }
    }

    /// Paths in what a macro is given.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Names = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.end(&mut path);
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' && colons < 2 && !path.is_empty() => colons += 1,
                TokenTree::Group(group) => {
                    self.end(&mut path);
                    self.tokens(group.stream());
                }
                _ => self.end(&mut path),
            }
        }
        self.end(&mut path);
    }

    fn end(&mut self, path: &mut Names) {
        if path.len() > 1 {
            self.path(path);
        }
        path.clear();
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if !is_test(attributes_of(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if let Some((_, items)) = &item.content {
            self.module.push(item.ident.to_string());
            self.items(items);
            self.module.pop();
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let mut paths: Vec<Names> = Vec::new();
        leaves(&item.tree, &mut Vec::new(), &mut |path, _| paths.push(path.to_vec()));
        paths.iter().for_each(|path| self.path(path));
    }

    fn visit_path(&mut self, path: &'ast Path) {
        let names: Names = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if names.len() > 1 && path.leading_colon.is_none() {
            self.path(&names);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast Macro) {
        self.visit_path(&item.path);
        self.tokens(item.tokens.clone());
    }

    fn visit_vis_restricted(&mut self, _: &'ast VisRestricted) {}
}

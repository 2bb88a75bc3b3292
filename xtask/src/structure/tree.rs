//! The files of a crate as modules, found from its root by their `mod` declarations.

use std::collections::BTreeMap;
use std::rc::Rc;

use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, ExprLit, Item, ItemMod, Lit, Meta, Token, UseTree};

/// A path of names: that of a module from its crate on, or one within it.
pub type Names = Vec<String>;

/// A file, which is a module.
pub struct File {
    /// Where it lies in the repository.
    pub path: String,
    /// The module that it is, from the crate on.
    pub module: Names,
    /// What it holds.
    pub syntax: Rc<syn::File>,
}

/// What a module can be asked for.
#[derive(Default)]
struct Scope {
    /// The file that it stands in.
    file: usize,
    /// What it takes or passes on under a name.
    imported: BTreeMap<String, Names>,
    /// Modules that it takes everything of.
    globs: Vec<Names>,
    /// What it defines.
    defined: Vec<String>,
}

/// A crate.
pub struct Tree {
    /// Its files; the first one is the root.
    pub files: Vec<File>,
    scopes: BTreeMap<Names, Scope>,
}

/// What a path leads to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Named {
    /// A module.
    Module(Names),
    /// Something that a file defines, with its name.
    Item(usize, String),
}

impl Tree {
    /// The crate of a name with its root file.
    ///
    /// # Errors
    /// A file that is missing or cannot be read as Rust.
    pub fn of(name: &str, root: &str, read: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        let mut tree = Self { files: Vec::new(), scopes: BTreeMap::new() };
        let text = read(root).ok_or_else(|| format!("{root}: there is no such file"))?;
        tree.add(root.to_owned(), vec![name.to_owned()], &text, read)?;
        Ok(tree)
    }

    fn add(
        &mut self,
        path: String,
        module: Names,
        text: &str,
        read: &dyn Fn(&str) -> Option<String>,
    ) -> Result<(), String> {
        let syntax = syn::parse_file(text).map_err(|e| format!("{path}: it cannot be read as Rust: {e}"))?;
        let syntax = Rc::new(syntax);
        let file = self.files.len();
        self.files.push(File { path: path.clone(), module: module.clone(), syntax: Rc::clone(&syntax) });
        self.enter(file, &path, &module, &syntax.items, read)
    }

    /// Takes up a module and those that it declares.
    fn enter(
        &mut self,
        file: usize,
        path: &str,
        module: &Names,
        items: &[Item],
        read: &dyn Fn(&str) -> Option<String>,
    ) -> Result<(), String> {
        let mut scope = Scope { file, ..Scope::default() };
        let mut children = Vec::new();
        for item in items.iter().filter(|item| !is_test(attributes_of(item))) {
            match item {
                Item::Mod(item) => children.push(item),
                Item::Use(item) => leaves(&item.tree, &mut Vec::new(), &mut |leaf, name| {
                    let target = self.absolute(module, leaf);
                    match name {
                        Some(name) => drop(scope.imported.insert(name.to_owned(), target)),
                        None => scope.globs.push(target),
                    }
                }),
                other => scope.defined.extend(name_of(other)),
            }
        }
        self.scopes.insert(module.clone(), scope);
        for child in children {
            self.declare(file, path, module, child, read)?;
        }
        Ok(())
    }

    fn declare(
        &mut self,
        file: usize,
        path: &str,
        module: &Names,
        child: &ItemMod,
        read: &dyn Fn(&str) -> Option<String>,
    ) -> Result<(), String> {
        let name = child.ident.to_string();
        let below: Names = module.iter().cloned().chain([name.clone()]).collect();
        if let Some((_, items)) = &child.content {
            return self.enter(file, path, &below, items, read);
        }
        let (folder, own) = path.rsplit_once('/').unwrap_or((".", path));
        let candidates = match path_attribute(&child.attrs) {
            Some(given) => vec![normal(&format!("{folder}/{given}"))],
            None => {
                let base = match own {
                    "mod.rs" | "lib.rs" | "main.rs" => folder.to_owned(),
                    _ => format!("{folder}/{}", own.trim_end_matches(".rs")),
                };
                vec![format!("{base}/{name}.rs"), format!("{base}/{name}/mod.rs")]
            }
        };
        let found = candidates.into_iter().find_map(|candidate| Some((read(&candidate)?, candidate)));
        let (text, candidate) = found.ok_or_else(|| format!("{path}: no file is found for `mod {name}`"))?;
        self.add(candidate, below, &text, read)
    }

    /// A path as it is written in a module, from the crate on; one that begins with another name stays relative to the
    /// module.
    pub fn absolute(&self, module: &[String], path: &[String]) -> Names {
        let mut base = module.to_vec();
        let mut rest = path;
        match rest.first().map(String::as_str) {
            Some("crate") => (base, rest) = (base[..1].to_vec(), &rest[1..]),
            Some("self") => rest = &rest[1..],
            _ => {
                while rest.first().is_some_and(|name| name == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
        }
        base.extend_from_slice(rest);
        base
    }

    /// Where a path from the crate on leads; `None`: to what is not of this crate.
    pub fn find(&self, path: &[String]) -> Option<Named> {
        self.find_within(path, 0)
    }

    fn find_within(&self, path: &[String], depth: usize) -> Option<Named> {
        /// Re-exports that may lead on from one to the next.
        const DEEPEST: usize = 16;
        if depth > DEEPEST {
            return None;
        }
        let mut module = path.get(..1)?.to_vec();
        let mut scope = self.scopes.get(&module)?;
        for (k, name) in path.iter().enumerate().skip(1) {
            let below: Names = module.iter().cloned().chain([name.clone()]).collect();
            if let Some(next) = self.scopes.get(&below) {
                (module, scope) = (below, next);
                continue;
            }
            if scope.defined.contains(name) {
                return Some(Named::Item(scope.file, name.clone()));
            }
            let on = |target: &Names| target.iter().chain(&path[k + 1..]).cloned().collect::<Names>();
            if let Some(target) = scope.imported.get(name) {
                return self.find_within(&on(target), depth + 1);
            }
            let by_glob = |target: &Names| {
                let from: Names = target.iter().chain(&path[k..]).cloned().collect();
                self.find_within(&from, depth + 1)
            };
            return scope.globs.iter().find_map(by_glob);
        }
        Some(Named::Module(module))
    }
}

/// The leaves of a `use`: each path, and the name by which it is known; no name for a glob.
pub fn leaves(tree: &UseTree, path: &mut Names, take: &mut dyn FnMut(&[String], Option<&str>)) {
    match tree {
        UseTree::Path(part) => {
            path.push(part.ident.to_string());
            leaves(&part.tree, path, take);
            path.pop();
        }
        UseTree::Name(part) if part.ident == "self" => {
            let last = path.last().cloned().unwrap_or_default();
            take(path, Some(&last));
        }
        UseTree::Name(part) => {
            path.push(part.ident.to_string());
            take(path, Some(&part.ident.to_string()));
            path.pop();
        }
        UseTree::Rename(part) => {
            let by_itself = part.ident == "self";
            if !by_itself {
                path.push(part.ident.to_string());
            }
            take(path, Some(&part.rename.to_string()));
            if !by_itself {
                path.pop();
            }
        }
        UseTree::Glob(_) => take(path, None),
        UseTree::Group(group) => group.items.iter().for_each(|item| leaves(item, path, take)),
    }
}

/// Whether something is there for tests alone.
pub fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        if attribute.path().is_ident("test") {
            return true;
        }
        let condition = attribute.path().is_ident("cfg").then(|| attribute.parse_args::<Meta>().ok()).flatten();
        condition.is_some_and(|meta| is_test_condition(&meta))
    })
}

fn is_test_condition(meta: &Meta) -> bool {
    match meta {
        Meta::Path(path) => path.is_ident("test"),
        Meta::List(list) if list.path.is_ident("all") => list
            .parse_args_with(Punctuated::<Meta, Token![,]>::parse_terminated)
            .is_ok_and(|all| all.iter().any(is_test_condition)),
        _ => false,
    }
}

/// The attributes of an item.
pub fn attributes_of(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// The name that an item defines.
fn name_of(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

/// The file that `#[path = "…"]` names.
fn path_attribute(attributes: &[Attribute]) -> Option<String> {
    attributes.iter().find_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("path") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value()),
            _ => None,
        },
        _ => None,
    })
}

/// A path without `..`.
fn normal(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

//! Modules depend on one another in one direction only.
//!
//! A module is a file. It imports what its code names, wherever that is defined: a name that came through a
//! re-export counts as an import from the module that defines it. Declaring children and re-exporting what is
//! theirs is no import; code for tests does not count.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility};

/// Names from the crate's root on.
type Names = Vec<String>;

/// A path as it is written, continued to the crate's root.
#[derive(Clone)]
struct Written {
    path: Names,
    /// Place of the first name that may be that of another crate; none behind `crate` and `super`.
    open: Option<usize>,
}

/// What one file says.
#[derive(Default)]
struct Module {
    children: BTreeSet<String>,
    /// What is defined here.
    items: BTreeSet<String>,
    /// Names that `use` binds here, and what they stand for.
    bound: BTreeMap<String, Written>,
    /// Modules all of whose names are bound here.
    globs: Vec<Names>,
    /// Paths that stand for an import.
    imports: Vec<Written>,
}

impl Module {
    fn has(&self, name: &str) -> bool {
        self.children.contains(name) || self.items.contains(name) || self.bound.contains_key(name)
    }
}

/// All modules of a crate by their path; the root's is empty.
struct Crate(BTreeMap<Names, Module>);

impl Crate {
    fn read(root: &Path) -> Self {
        let mut modules = Self(BTreeMap::new());
        let directory = root.parent().unwrap();
        modules.file(root, directory, Names::new());
        modules
    }

    /// Reads a file and those of its children, which lie in `directory`.
    fn file(&mut self, file: &Path, directory: &Path, path: Names) {
        let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        self.items(&parsed.items, directory, path);
    }

    fn items(&mut self, items: &[Item], directory: &Path, path: Names) {
        let mut reader = Reader {
            path: &path,
            module: Module::default(),
            inner: Vec::new(),
        };
        items.iter().for_each(|item| reader.visit_item(item));
        let Reader {
            mut module, inner, ..
        } = reader;
        // All names of another crate are none of this one.
        let mut globs = std::mem::take(&mut module.globs);
        globs.retain(|glob| match glob.strip_prefix(&path[..]) {
            Some([first, ..]) => module.has(first),
            _ => true,
        });
        module.globs = globs;
        self.0.insert(path.clone(), module);
        for child in inner {
            let name = child.ident.to_string();
            let below = directory.join(&name);
            let path = [&path[..], std::slice::from_ref(&name)].concat();
            match &child.content {
                Some((_, items)) => self.items(items, &below, path),
                None => {
                    let beside = directory.join(format!("{name}.rs"));
                    let inside = below.join("mod.rs");
                    let file: PathBuf = if beside.exists() { beside } else { inside };
                    self.file(&file, &below, path);
                }
            }
        }
    }

    /// The module that defines what a path stands for; none if that is another crate's.
    fn defined_in(&self, written: &Written) -> Option<Names> {
        self.followed(&written.path, written.open, &mut BTreeSet::new())
    }

    fn followed(
        &self,
        path: &[String],
        open: Option<usize>,
        seen: &mut BTreeSet<Names>,
    ) -> Option<Names> {
        // Names of another crate of the workspace are none of this one.
        let is_other = |name: &String| name.starts_with("turncal");
        if path.iter().any(is_other) || !seen.insert(path.to_vec()) {
            return None;
        }
        for end in 0..path.len() {
            let (at, name, rest) = (&path[..end], &path[end], &path[end + 1..]);
            let module = self.0.get(at)?;
            if module.children.contains(name) {
                continue;
            }
            if module.items.contains(name) {
                return Some(at.to_vec());
            }
            if let Some(bound) = module.bound.get(name) {
                let path = [&bound.path[..], rest].concat();
                return self.followed(&path, bound.open, seen);
            }
            let through_glob = module.globs.iter().find_map(|glob| {
                let path = [&glob[..], &path[end..]].concat();
                self.followed(&path, Some(glob.len()), seen)
            });
            // What is nowhere written was made by a macro.
            let made_here = || (open != Some(end)).then(|| at.to_vec());
            return through_glob.or_else(made_here);
        }
        self.0.contains_key(path).then(|| path.to_vec())
    }

    /// Each module with those that it imports and, for each, one of the paths that do.
    fn edges(&self) -> BTreeMap<Names, BTreeMap<Names, String>> {
        let of_module = |(path, module): (&Names, &Module)| {
            let mut imported = BTreeMap::new();
            for import in &module.imports {
                if let Some(target) = self.defined_in(import).filter(|target| target != path) {
                    let name = import.path.last().cloned().unwrap_or_default();
                    imported.entry(target).or_insert(name);
                }
            }
            (path.clone(), imported)
        };
        self.0.iter().map(of_module).collect()
    }

    /// The strongly connected components of more than one module, each with a shortest circle in it.
    fn circles(&self) -> Vec<Circle> {
        let edges = self.edges();
        let mut circles = Vec::new();
        let mut done = BTreeSet::new();
        for start in edges.keys() {
            if done.contains(start) {
                continue;
            }
            let reached: BTreeSet<&Names> = ways(&edges, start).into_keys().collect();
            let returns = |to: &&Names| ways(&edges, to).contains_key(start);
            let members: BTreeSet<Names> = reached.into_iter().filter(returns).cloned().collect();
            if members.is_empty() {
                continue;
            }
            let shortest = members
                .iter()
                .filter_map(|member| ways(&edges, member).remove(member))
                .min_by_key(Vec::len)
                .unwrap();
            done.extend(members.iter().cloned());
            let inside = edges
                .iter()
                .flat_map(|(from, to)| to.iter().map(move |(to, name)| (from, to, name)))
                .filter(|(from, to, _)| members.contains(*from) && members.contains(*to))
                .map(|(from, to, name)| format!("{} → {} ({name})", shown(from), shown(to)))
                .collect();
            circles.push(Circle {
                members,
                shortest,
                inside,
            });
        }
        circles
    }
}

struct Circle {
    members: BTreeSet<Names>,
    /// From a module back to it: what each step imports, and from where.
    shortest: Vec<(Names, String)>,
    /// All imports between members.
    inside: Vec<String>,
}

impl Circle {
    fn words(&self) -> String {
        let (last, _) = self.shortest.last().unwrap();
        let steps = self.shortest.iter();
        let steps: Vec<String> = steps
            .map(|(to, name)| format!("imports {name} from {}", shown(to)))
            .collect();
        format!(
            "{} modules in a circle: {}\n  shortest: {} {}\n  all imports between them:\n    {}",
            self.members.len(),
            self.members
                .iter()
                .map(|m| shown(m))
                .collect::<Vec<_>>()
                .join(", "),
            shown(last),
            steps.join(", which "),
            self.inside.join("\n    ")
        )
    }
}

fn shown(path: &[String]) -> String {
    if path.is_empty() {
        "the crate's root".to_owned()
    } else {
        path.join("::")
    }
}

/// From a module to every module that it imports directly or through others: the steps of a shortest way.
fn ways<'a>(
    edges: &'a BTreeMap<Names, BTreeMap<Names, String>>,
    from: &Names,
) -> BTreeMap<&'a Names, Vec<(Names, String)>> {
    let mut ways = BTreeMap::<&Names, Vec<(Names, String)>>::new();
    let mut next = VecDeque::from([(from, Vec::new())]);
    while let Some((at, way)) = next.pop_front() {
        for (to, name) in &edges[at] {
            if !ways.contains_key(to) {
                let mut way = way.clone();
                way.push((to.clone(), name.clone()));
                ways.insert(to, way.clone());
                next.push_back((to, way));
            }
        }
    }
    ways
}

/// Reads one file.
struct Reader<'a> {
    path: &'a [String],
    module: Module,
    inner: Vec<ItemMod>,
}

impl Reader<'_> {
    fn written(&self, names: &[String]) -> Written {
        let mut path = self.path.to_vec();
        let mut open = Some(path.len());
        for (place, name) in names.iter().enumerate() {
            match (name.as_str(), place) {
                ("crate", 0) => path.clear(),
                ("self", 0) => {}
                ("super", _) => {
                    path.pop();
                }
                _ => {
                    path.push(name.clone());
                    continue;
                }
            }
            open = None;
        }
        Written { path, open }
    }

    fn used(&mut self, tree: &UseTree, before: &[String], re_exported: bool) {
        let joined = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        let (written, name) = match tree {
            UseTree::Path(path) => return self.used(&path.tree, &joined(&path.ident), re_exported),
            UseTree::Group(group) => {
                let trees = group.items.iter();
                return trees.for_each(|tree| self.used(tree, before, re_exported));
            }
            UseTree::Name(one) if one.ident == "self" => (before.to_vec(), before.last().cloned()),
            UseTree::Name(one) => (joined(&one.ident), Some(one.ident.to_string())),
            UseTree::Rename(one) => (joined(&one.ident), Some(one.rename.to_string())),
            UseTree::Glob(_) => (before.to_vec(), None),
        };
        let target = self.written(&written);
        let below = target.path.len() > self.path.len() && target.path.starts_with(self.path);
        if !(re_exported && below) {
            self.import(&written);
        }
        match name {
            Some(name) => {
                self.module.bound.insert(name, target);
            }
            None => self.module.globs.push(target.path),
        }
    }

    fn import(&mut self, names: &[String]) {
        let written = self.written(names);
        self.module.imports.push(written);
    }
}

fn for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.meta.require_list().is_ok_and(|list| {
                let tokens = list.tokens.to_string();
                tokens == "test" || tokens.starts_with("all (test")
            })
    })
}

impl<'a> Visit<'a> for Reader<'_> {
    fn visit_item(&mut self, item: &'a Item) {
        let (attributes, name) = match item {
            Item::Const(item) => (&item.attrs, Some(&item.ident)),
            Item::Enum(item) => (&item.attrs, Some(&item.ident)),
            Item::Fn(item) => (&item.attrs, Some(&item.sig.ident)),
            Item::Static(item) => (&item.attrs, Some(&item.ident)),
            Item::Struct(item) => (&item.attrs, Some(&item.ident)),
            Item::Trait(item) => (&item.attrs, Some(&item.ident)),
            Item::Type(item) => (&item.attrs, Some(&item.ident)),
            Item::Union(item) => (&item.attrs, Some(&item.ident)),
            Item::Impl(item) => (&item.attrs, None),
            Item::Macro(item) => (&item.attrs, item.ident.as_ref()),
            Item::Mod(item) => (&item.attrs, None),
            Item::Use(item) => (&item.attrs, None),
            _ => panic!(
                "an item that this test does not know in {}",
                shown(self.path)
            ),
        };
        if for_tests(attributes) {
            return;
        }
        self.module.items.extend(name.map(ToString::to_string));
        visit::visit_item(self, item);
    }

    // Neither `pub(in path)` nor the paths of attributes import anything.
    fn visit_visibility(&mut self, _: &'a Visibility) {}

    fn visit_attribute(&mut self, _: &'a Attribute) {}

    fn visit_item_mod(&mut self, item: &'a ItemMod) {
        self.module.children.insert(item.ident.to_string());
        self.inner.push(item.clone());
    }

    fn visit_item_use(&mut self, item: &'a ItemUse) {
        let re_exported = !matches!(item.vis, Visibility::Inherited);
        self.used(&item.tree, &[], re_exported);
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if !for_tests(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let written: Names = path.segments.iter().map(|s| s.ident.to_string()).collect();
        // A single name may be a variable's, and a module alone is no value.
        if written.len() > 1 || !self.module.children.contains(&written[0]) {
            self.import(&written);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        // Inside a macro there are only tokens: names joined by `::`.
        let tokens = call.tokens.to_string().replace("::", " :: ");
        let mut written = Names::new();
        let mut joined = false;
        let is_name = |word: &str| word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let words = tokens.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        for word in words.filter(|word| !word.is_empty()) {
            if word == "::" {
                joined = true;
            } else if is_name(word) {
                if !joined {
                    self.mentioned_in_macro(&written);
                    written.clear();
                }
                written.push(word.to_owned());
                joined = false;
            }
        }
        self.mentioned_in_macro(&written);
        visit::visit_macro(self, call);
    }
}

impl Reader<'_> {
    fn mentioned_in_macro(&mut self, written: &[String]) {
        if written.len() > 1 {
            self.import(written);
        }
    }
}

#[test]
fn no_module_imports_one_that_imports_it() {
    let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let crates = fs::read_dir(workspace.join("crates")).unwrap();
    let crates = crates.map(|entry| entry.unwrap().path());
    let of_crate = |root: PathBuf| {
        let circles = Crate::read(&root.join("src/lib.rs")).circles();
        let words = circles.iter().map(Circle::words);
        words
            .map(|words| format!("{}: {words}", root.display()))
            .collect::<Vec<_>>()
    };
    let roots = crates.chain([workspace.to_path_buf()]);
    let circles: Vec<String> = roots.flat_map(of_crate).collect();
    assert!(circles.is_empty(), "{}", circles.join("\n\n"));
}

/// The members of each circle of a crate made of these files.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = directory.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let circles = Crate::read(&directory.path().join("lib.rs")).circles();
    circles
        .iter()
        .map(|circle| {
            let members: Vec<String> = circle.members.iter().map(|m| shown(m)).collect();
            members.join(" ")
        })
        .collect()
}

#[test]
fn a_circle_is_found_through_re_exports_code_macros_and_other_modules() {
    let lib = ("lib.rs", "pub mod room;");
    let room = (
        "room/mod.rs",
        "mod a;\nmod b;\nmod c;\npub use a::A;\npub use c::*;",
    );
    let a = ("room/a.rs", "use super::b::B;\npub struct A(B);");
    let plain = ("room/c.rs", "pub struct C;");
    for b in [
        "use super::a::A;\npub struct B;\nfn f(_: &A) {}",
        "use super::A;\npub struct B;\nfn f(_: &A) {}",
        "use crate::room::{A as Other};\npub struct B;",
        "pub struct B;\nfn f() { let _ = super::A::new(); }",
        "pub struct B;\nfn f() { assert!(crate::room::a::A::sound(1)); }",
        "use crate::room;\npub struct B;\nfn f(_: room::A) {}",
    ] {
        let found = circles_of(&[lib, room, a, ("room/b.rs", b), plain]);
        assert_eq!(found, ["room::a room::b"], "{b}");
    }
    // Through a third one that is only known by a glob.
    let b = ("room/b.rs", "use super::C;\npub struct B(C);");
    let c = (
        "room/c.rs",
        "pub struct C;\nimpl C { fn f(_: super::A) {} }",
    );
    assert_eq!(
        circles_of(&[lib, room, a, b, c]),
        ["room::a room::b room::c"]
    );
}

#[test]
fn a_parent_that_uses_a_child_which_uses_it_is_a_circle_and_one_that_re_exports_it_is_none() {
    let lib = ("lib.rs", "mod parent;");
    let child = (
        "parent/child.rs",
        "use super::Shared;\npub struct Child(Shared);\n#[cfg(test)]\nmod tests;",
    );
    let of = |parent| circles_of(&[lib, ("parent.rs", parent), child]);
    let declares = "mod child;\npub use child::Child;\npub struct Shared;";
    assert_eq!(of(declares), [""; 0]);
    for uses in [
        "mod child;\nuse child::Child;\npub struct Shared;\nfn f(_: Child) {}",
        "mod child;\npub use child::Child;\npub struct Shared;\nfn f(_: Child) {}",
        "mod child;\npub struct Shared;\nfn f() { child::Child::make(); }",
        "mod child;\npub struct Shared;\nfn f() { println!(\"{}\", child::Child::make()); }",
    ] {
        assert_eq!(of(uses), ["parent parent::child"], "{uses}");
    }
    let for_tests =
        "mod child;\npub struct Shared;\n#[cfg(test)]\nmod tests { use super::child::Child; }";
    assert_eq!(of(for_tests), [""; 0]);
}

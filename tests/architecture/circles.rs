//! Circles among the modules of a crate. In each folder its files and folders are the nodes; an arrow leads from one to another where code
//! inside of the first names code inside of the second, through re-exports too. What a folder's `mod.rs` and its files share is no circle.

use super::files::{members, sources};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fs, iter};

/// Modules in a circle cannot be understood one after the other; of three a reader keeps track.
const LARGEST: usize = 3;

/// A module by its path below the crate.
type Module = Vec<String>;

#[test]
fn circles_of_modules_are_small() {
    for folder in members() {
        let sources = modules(&folder.join("src"));
        for circle in circles(&sources) {
            assert!(circle.len() <= LARGEST, "{}: a circle of {} modules: {circle:?}", folder.display(), circle.len());
        }
    }
}

#[test]
fn a_circle_is_found() {
    let text = [
        ("", "mod a; mod b; mod c; mod d; pub use b::{First, Second,};"),
        ("a", "use crate::Second as S; // use crate::d::D;"),
        ("b", "use super::{c::{self, Third,}, d,}; fn f() { \"crate::a::x\" }"),
        ("c", "fn f() { crate::a::g(); }"),
        ("d", "use crate::Absent; #[cfg(test)] mod tests { use crate::b; }"),
    ];
    let sources = text.map(|(name, text)| (name.split_terminator('/').map(str::to_owned).collect(), tokens(text)));
    assert_eq!(circles(&BTreeMap::from(sources)), [["a", "b", "c"].map(str::to_owned).to_vec()]);
}

/// The tokens of each module of a crate, without those of tests.
fn modules(src: &Path) -> BTreeMap<Module, Vec<String>> {
    let module = |file: &Path| -> Option<Module> {
        let mut names: Module =
            file.strip_prefix(src).ok()?.with_extension("").iter().map(|n| n.to_string_lossy().into()).collect();
        names.pop_if(|name| name == "mod" || name == "lib");
        (!names.iter().any(|name| name.ends_with("tests") || name == "main")).then_some(names)
    };
    let read = |file: &Path| tokens(&fs::read_to_string(file).expect("readable"));
    sources(src).iter().filter_map(|file| Some((module(file)?, read(file)))).collect()
}

/// Names, `::` and punctuation, without comments and texts, up to the tests.
fn tokens(text: &str) -> Vec<String> {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or(text);
    let text = text.split("#[cfg(test)] mod tests {").next().unwrap_or(text);
    let mut out: Vec<String> = Vec::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if c == '"' {
            let quoted = |(k, _): &(usize, &str)| !rest[..*k].ends_with('\\') || rest[..*k].ends_with("\\\\");
            rest[1..].match_indices('"').map(|(k, q)| (k + 1, q)).find(quoted).map_or(rest.len(), |(k, _)| k + 1)
        } else if c.is_alphanumeric() || c == '_' {
            rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            c.len_utf8()
        };
        let token = &rest[..length];
        if !token.starts_with("//") && !token.starts_with('"') && !c.is_whitespace() {
            out.push(token.to_owned());
        }
        rest = &rest[length..];
    }
    out
}

/// Each path of a tree like `crate::{a::B, c as d}` with its local name, and the place behind the tree.
fn tree(tokens: &[String], mut place: usize, prefix: &[String]) -> (Vec<(String, Module)>, usize) {
    let mut path = prefix.to_vec();
    let at = |place: usize| tokens.get(place).map_or("", String::as_str);
    loop {
        match at(place) {
            "{" => {
                let mut all = Vec::new();
                place += 1;
                while !["}", ""].contains(&at(place)) {
                    let (found, behind) = tree(tokens, place, &path);
                    all.extend(found);
                    place = behind + usize::from(at(behind) == ",");
                }
                return (all, place + 1);
            }
            "self" if !prefix.is_empty() => (),
            name => path.push(name.to_owned()),
        }
        place += 1;
        match at(place) {
            "::" => place += 1,
            "as" => return (vec![(at(place + 1).to_owned(), path)], place + 2),
            _ => return (vec![(path.last().cloned().unwrap_or_default(), path)], place),
        }
    }
}

/// All paths of a module that begin inside of the crate, absolute, with the names that `use` gives them.
fn paths(module: &Module, sources: &BTreeMap<Module, Vec<String>>) -> Vec<(Option<String>, Module)> {
    let tokens = &sources[module];
    let mut all = Vec::new();
    for (k, token) in tokens.iter().enumerate() {
        let before = k.checked_sub(1).map_or("", |k| &tokens[k]);
        let leads = tokens.get(k + 1).is_some_and(|next| next == "::") && before != "::";
        let own = before == "use" && sources.contains_key(&child(module, token));
        if leads && (own || ["crate", "super", "self"].contains(&token.as_str())) {
            let named = before == "use";
            all.extend(
                tree(tokens, k, &[]).0.into_iter().map(|(name, path)| (named.then_some(name), absolute(module, &path))),
            );
        }
    }
    all
}

fn child(module: &Module, name: &str) -> Module {
    module.iter().cloned().chain([name.to_owned()]).collect()
}

fn absolute(module: &Module, path: &[String]) -> Module {
    let mut base = module.clone();
    for (k, name) in path.iter().enumerate() {
        match name.as_str() {
            "crate" => base.clear(),
            "super" => drop(base.pop()),
            "self" => (),
            _ => return base.into_iter().chain(path[k..].iter().cloned()).collect(),
        }
    }
    base
}

/// The module in which the code of a path is; `named` are the paths that each module knows by a name of its own.
fn home(path: &[String], named: &BTreeMap<Module, BTreeMap<String, Module>>, depth: usize) -> Module {
    let known = (0..=path.len()).rev().find(|k| named.contains_key(&path[..*k])).unwrap_or(0);
    let (module, rest) = path.split_at(known);
    let elsewhere = rest.first().and_then(|name| named.get(module)?.get(name)).filter(|_| depth > 0);
    match elsewhere {
        Some(other) => home(&other.iter().chain(&rest[1..]).cloned().collect::<Vec<_>>(), named, depth - 1),
        None => module.to_vec(),
    }
}

/// The circles of each folder, as names of their modules.
fn circles(sources: &BTreeMap<Module, Vec<String>>) -> Vec<Vec<String>> {
    let all: BTreeMap<Module, Vec<(Option<String>, Module)>> =
        sources.keys().map(|module| (module.clone(), paths(module, sources))).collect();
    let named = all
        .iter()
        .map(|(module, paths)| {
            (module.clone(), paths.iter().filter_map(|(name, path)| Some((name.clone()?, path.clone()))).collect())
        })
        .collect();
    // Arrows between the children of one folder, by the path of both.
    let mut arrows: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (from, paths) in &all {
        for (_, path) in paths {
            let to = home(path, &named, 8);
            let common = iter::zip(from, &to).take_while(|(a, b)| a == b).count();
            if common < from.len() && common < to.len() {
                arrows.entry(from[..=common].to_vec()).or_default().insert(to[..=common].to_vec());
            }
        }
    }
    let reached: BTreeMap<&Module, BTreeSet<Module>> = arrows.keys().map(|from| (from, reach(from, &arrows))).collect();
    let mut found = BTreeSet::new();
    for (from, to) in &reached {
        let circle: Vec<String> = to
            .iter()
            .filter(|m| reached.get(m).is_some_and(|back| back.contains(*from)))
            .map(|m| m.join("/"))
            .collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    found.into_iter().collect()
}

fn reach(from: &Module, arrows: &BTreeMap<Module, BTreeSet<Module>>) -> BTreeSet<Module> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(module) = open.pop() {
        for next in arrows.get(module).into_iter().flatten() {
            if reached.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    reached
}

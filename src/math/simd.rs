//! Which vector instructions to use: the best that the processor has, or fewer if the environment says so.
//!
//! The same bits come of all of them. To ask for fewer is for tests, and to find out what they gain.

use fearless_simd::Level;
use std::sync::OnceLock;

/// The environment's variable that names the most that may be used.
pub const VARIABLE: &str = "SNELL_SIMD";

/// What was chosen, once for all.
static CHOSEN: OnceLock<Level> = OnceLock::new();

/// The instructions to use. What the environment says counts from the first call on; if that is nonsense, which [`check`] reports,
/// not at all.
pub fn level() -> Level {
    *CHOSEN.get_or_init(|| asked_for().unwrap_or_else(|_| Level::new()))
}

/// Fails, with a message, where the environment asks for instructions that the processor lacks, or that nobody knows.
pub fn check() -> Result<(), String> {
    asked_for().map(|_| ())
}

/// Of a level, what it is called in the environment.
pub fn name(level: Level) -> &'static str {
    names().into_iter().rev().find(|(_, other)| other.is_some_and(|other| same(other, level))).map_or("none", |n| n.0)
}

fn asked_for() -> Result<Level, String> {
    std::env::var_os(VARIABLE).map_or(Ok(Level::new()), |name| choose(&name.to_string_lossy()))
}

fn choose(name: &str) -> Result<Level, String> {
    let names = names();
    let found = names.iter().find(|(other, _)| *other == name).and_then(|(_, level)| *level);
    found.ok_or_else(|| {
        let here =
            names.iter().filter(|(_, level)| level.is_some()).map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!("{VARIABLE} is '{name}', but here there is only {here}")
    })
}

/// All names, and what this processor has of them, from the least on.
#[cfg(target_arch = "x86_64")]
fn names() -> Vec<(&'static str, Option<Level>)> {
    let best = Level::new();
    vec![
        ("sse2", best.as_sse2().map(Level::Sse2)),
        ("sse4.2", best.as_sse4_2().map(Level::Sse4_2)),
        ("avx2", best.as_avx2().map(Level::Avx2)),
        ("avx512", best.as_avx512().map(Level::Avx512)),
    ]
}

/// All names: elsewhere there is no choice.
#[cfg(not(target_arch = "x86_64"))]
fn names() -> Vec<(&'static str, Option<Level>)> {
    vec![("best", Some(Level::new()))]
}

/// All that this processor has, from the least on.
#[cfg(test)]
pub(crate) fn levels() -> Vec<Level> {
    names().into_iter().filter_map(|(_, level)| level).collect()
}

fn same(a: Level, b: Level) -> bool {
    std::mem::discriminant(&a) == std::mem::discriminant(&b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_chosen_by_their_names_and_no_others_are() {
        for (name, level) in names() {
            match level {
                Some(level) => {
                    assert!(same(choose(name).unwrap(), level), "{name}");
                    assert_eq!(super::name(level), name);
                }
                None => assert!(choose(name).is_err(), "{name}"),
            }
        }
        assert!(choose("mmx").unwrap_err().starts_with("SNELL_SIMD is 'mmx', but here there is only "));
    }
}

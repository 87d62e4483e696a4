//! "Did you mean": the known name nearest to an unknown one.

/// Largest number of edits, as a fraction of the longer name, at which a name still looks like a slip of another.
const MAX_EDIT_FRACTION: f64 = 0.4;

/// The end of an error message about `wrong`: the nearest of the `known` names, or all of them.
pub(crate) fn suggestion<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_unstable();
    known.dedup();
    let nearest = known.iter().map(|name| (strsim::damerau_levenshtein(wrong, name), *name)).min();
    match nearest {
        None => String::new(),
        Some((edits, name)) if is_near(edits, wrong, name) => format!("; did you mean '{name}'?"),
        Some(_) => format!("; known: {}", known.join(", ")),
    }
}

fn is_near(edits: usize, a: &str, b: &str) -> bool {
    let longer = a.chars().count().max(b.chars().count());
    edits as f64 <= MAX_EDIT_FRACTION * longer as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_named_and_strangers_listed() {
        assert_eq!(suggestion("difuse", ["diffuse", "dielectric"]), "; did you mean 'diffuse'?");
        assert_eq!(suggestion("wood", ["diffuse", "dielectric"]), "; known: dielectric, diffuse");
        assert_eq!(suggestion("x", []), "");
    }
}

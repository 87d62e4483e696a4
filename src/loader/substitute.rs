//! `$name` parameters: `<default>`s and the command line's definitions, and their substitution into attribute values.

use super::suggest::suggestion;
use std::collections::{BTreeSet, HashMap};

/// Longest attribute value after substitution, in bytes. Reason: defaults may use earlier defaults, so a few lines could
/// double a value without end; real values are short, and what is longer is written out, not substituted.
const MAX_SUBSTITUTED_BYTES: usize = 1 << 16;

#[derive(Debug)]
struct Parameter {
    value: String,
    /// Whether it must be used: it comes from the command line and was not used yet.
    pending: bool,
}

/// The parameters known so far.
#[derive(Debug, Default)]
pub(crate) struct Parameters {
    /// By name.
    known: HashMap<String, Parameter>,
    /// The lengths of the names, in bytes.
    lengths: BTreeSet<usize>,
}

impl Parameters {
    /// The command line's.
    pub(crate) fn new(defines: &[(String, String)]) -> Self {
        let mut parameters = Self::default();
        for (name, value) in defines {
            // Of two definitions of a name the last holds, as usual on command lines.
            parameters.known.remove(name);
            parameters.insert(name, value, true);
        }
        parameters
    }

    /// A `<default>`: holds unless there is a value already.
    pub(crate) fn add_default(&mut self, name: &str, value: &str) {
        if !self.known.contains_key(name) {
            self.insert(name, value, false);
        }
    }

    fn insert(&mut self, name: &str, value: &str, pending: bool) {
        self.lengths.insert(name.len());
        self.known.insert(name.into(), Parameter { value: value.into(), pending });
    }

    /// The parameter that `text` begins with, and how long its name is. Of several the longest, so that `$spp2` is not
    /// taken for `$spp` followed by 2.
    fn longest(&mut self, text: &str) -> Option<(usize, &mut Parameter)> {
        let is_known =
            |&length: &usize| length > 0 && text.get(..length).is_some_and(|name| self.known.contains_key(name));
        let length = self.lengths.iter().rev().copied().find(is_known)?;
        self.known.get_mut(&text[..length]).map(|parameter| (length, parameter))
    }

    /// `text` with every `$name` replaced and every `\$` become `$`, or what is wrong with it.
    pub(crate) fn substitute(&mut self, text: &str) -> Result<String, String> {
        let mut out = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(dollar) = rest.find('$') {
            let (before, after) = (&rest[..dollar], &rest[dollar + 1..]);
            if let Some(before) = before.strip_suffix('\\') {
                out.push_str(before);
                out.push('$');
                rest = after;
                continue;
            }
            out.push_str(before);
            match self.longest(after) {
                Some((length, parameter)) => {
                    parameter.pending = false;
                    out.push_str(&parameter.value);
                    rest = &after[length..];
                }
                None => return Err(self.undefined(after)),
            }
            if out.len() > MAX_SUBSTITUTED_BYTES {
                return Err(format!("the value is longer than {MAX_SUBSTITUTED_BYTES} bytes after substitution"));
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    fn undefined(&self, after: &str) -> String {
        let end = after.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(after.len());
        let name = &after[..end];
        let known = self.known.keys().map(String::as_str);
        format!("undefined parameter '${name}'{}", suggestion(name, known))
    }

    /// What to say of a definition of the command line that was not used, if there is one.
    pub(crate) fn unused(&self) -> Option<String> {
        // The first by name, for the order in the map is another each time.
        let (name, unused) = self.known.iter().filter(|(_, p)| p.pending).min_by_key(|(name, _)| *name)?;
        let known = self.known.iter().filter(|(_, p)| !p.pending).map(|(name, _)| name.as_str());
        let hint = suggestion(name, known);
        Some(format!("-D {name}={}: the scene has no such parameter{hint}", unused.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_name_and_the_command_line_win() {
        let mut p = Parameters::new(&[("a".into(), "1".into())]);
        p.add_default("ab", "2");
        p.add_default("a", "9");
        assert_eq!(p.substitute("$ab$a \\$a").unwrap(), "21 $a");
        assert_eq!(p.unused(), None);
        assert_eq!(p.substitute("$c").unwrap_err(), "undefined parameter '$c'; known: a, ab");
    }

    #[test]
    fn unused_definitions_are_named() {
        let mut p = Parameters::new(&[("sp".into(), "1".into())]);
        p.add_default("spp", "2");
        assert_eq!(p.unused().unwrap(), "-D sp=1: the scene has no such parameter; did you mean 'spp'?");
    }

    #[test]
    fn values_cannot_grow_without_end() {
        let mut p = Parameters::default();
        p.add_default("x", "0123456789");
        for _ in 0..8 {
            let Ok(doubled) = p.substitute(&"$x".repeat(10)) else {
                return;
            };
            p = Parameters::default();
            p.add_default("x", &doubled);
        }
        panic!("a value of 10^9 bytes was accepted");
    }
}

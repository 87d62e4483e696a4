//! `$name` parameters: `<default>`s and the command line's definitions, and their substitution into attribute values.

use super::suggest::suggestion;

/// Longest attribute value after substitution, in bytes. Reason: defaults may use earlier defaults, so a few lines could
/// double a value without end; real values are short, and what is longer is written out, not substituted.
const MAX_SUBSTITUTED_BYTES: usize = 1 << 16;

#[derive(Debug)]
struct Parameter {
    name: String,
    value: String,
    /// Whether it must be used: it comes from the command line and was not used yet.
    pending: bool,
}

/// The parameters known so far.
#[derive(Debug, Default)]
pub(crate) struct Parameters {
    /// Longest name first, so that `$spp2` is not taken for `$spp` followed by 2.
    list: Vec<Parameter>,
}

impl Parameters {
    /// The command line's.
    pub(crate) fn new(defines: &[(String, String)]) -> Self {
        let mut parameters = Self::default();
        for (name, value) in defines {
            // Of two definitions of a name the last holds, as usual on command lines.
            parameters.list.retain(|p| p.name != *name);
            parameters.insert(name, value, true);
        }
        parameters
    }

    /// A `<default>`: holds unless there is a value already.
    pub(crate) fn add_default(&mut self, name: &str, value: &str) {
        if self.list.iter().all(|p| p.name != name) {
            self.insert(name, value, false);
        }
    }

    fn insert(&mut self, name: &str, value: &str, pending: bool) {
        let at = self.list.partition_point(|p| p.name.len() >= name.len());
        self.list.insert(at, Parameter { name: name.into(), value: value.into(), pending });
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
            match self.list.iter_mut().find(|p| !p.name.is_empty() && after.starts_with(&p.name)) {
                Some(parameter) => {
                    parameter.pending = false;
                    out.push_str(&parameter.value);
                    rest = &after[parameter.name.len()..];
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
        let known = self.list.iter().map(|p| p.name.as_str());
        format!("undefined parameter '${name}'{}", suggestion(name, known))
    }

    /// What to say of a definition of the command line that was not used, if there is one.
    pub(crate) fn unused(&self) -> Option<String> {
        let unused = self.list.iter().find(|p| p.pending)?;
        let known = self.list.iter().filter(|p| !p.pending).map(|p| p.name.as_str());
        let hint = suggestion(&unused.name, known);
        Some(format!("-D {}={}: the scene has no such parameter{hint}", unused.name, unused.value))
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

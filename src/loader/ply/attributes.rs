//! Which properties of an element together are an attribute, by Mitsuba 3.9's rules.
//!
//! Properties r, g, b, or red, green, blue, in any order, and perhaps a or alpha, are the attribute "color"; p_r, p_g, p_b
//! are "p_color"; p_x, p_y, p_z, or p_0 (or p_1) and the next two, or only the first of them, are "p". In front stands what
//! they belong to: "vertex_color". All others are left alone.

use super::header::Property;

/// The letters and words of a colour's channels.
const COLOURS: [[&str; 4]; 2] = [["r", "g", "b", "a"], ["red", "green", "blue", "alpha"]];

/// Ends of the names of other numbers that belong together.
const NUMBERED: [[&str; 3]; 3] = [["x", "y", "z"], ["0", "1", "2"], ["1", "2", "3"]];

/// An attribute.
#[derive(Debug, PartialEq)]
pub(super) struct Columns {
    /// Its name.
    pub(super) name: String,
    /// The properties that give its numbers.
    pub(super) columns: Vec<usize>,
}

/// Those of an element of this name; properties that are `known` as something else are none.
pub(super) fn of(element: &str, properties: &[Property], known: &[&str]) -> Vec<Columns> {
    let column = |name: &str| properties.iter().position(|p| p.name == name && p.length.is_none());
    let mut found: Vec<Columns> = Vec::new();
    for property in properties.iter().filter(|p| !known.contains(&p.name.as_str())) {
        // Each group is found by its first name.
        let (prefix, end) = property.name.rsplit_once('_').map_or(("", property.name.as_str()), |(p, end)| (p, end));
        let full = |end: &str| if prefix.is_empty() { end.to_owned() } else { format!("{prefix}_{end}") };
        let attribute = COLOURS.iter().find(|names| names[0] == end).and_then(|names| {
            let mut columns: Vec<usize> = names[..3].iter().map_while(|name| column(&full(name))).collect();
            let is_whole = columns.len() == 3 && (prefix.is_empty() || names[0].len() == 1);
            columns.extend(column(&full(names[3])));
            is_whole.then(|| Columns { name: format!("{element}_{}", full("color")), columns })
        });
        let numbered = || {
            let names = NUMBERED.iter().find(|names| names[0] == end && !prefix.is_empty())?;
            // The second row's 1 is not the third row's first.
            let continues = names[0] == "1" && column(&full("0")).is_some();
            let columns: Vec<usize> = names.iter().map_while(|name| column(&full(name))).collect();
            let is_whole = (columns.len() == 1 || columns.len() == 3) && !continues;
            is_whole.then(|| Columns { name: format!("{element}_{prefix}"), columns })
        };
        found.extend(attribute.or_else(numbered));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::header::Scalar;
    use super::*;

    fn names(list: &str) -> Vec<(String, Vec<usize>)> {
        let property = |name: &str| Property { name: name.into(), length: None, scalar: Scalar::F32 };
        let properties: Vec<Property> = list.split(' ').map(property).collect();
        of("vertex", &properties, &["x", "y", "z"]).into_iter().map(|a| (a.name, a.columns)).collect()
    }

    /// What Mitsuba 3.9.1 makes of the same properties.
    #[test]
    fn groups_are_those_of_mitsuba() {
        let one = |name: &str, columns: &[usize]| vec![(name.to_owned(), columns.to_vec())];
        assert_eq!(names("x y z r g b"), one("vertex_color", &[3, 4, 5]));
        assert_eq!(names("b g r"), one("vertex_color", &[2, 1, 0]));
        assert_eq!(names("red green blue alpha"), one("vertex_color", &[0, 1, 2, 3]));
        assert_eq!(names("foo_r foo_g foo_b"), one("vertex_foo_color", &[0, 1, 2]));
        assert_eq!(names("a_b_0"), one("vertex_a_b", &[0]));
        assert_eq!(names("foo_1 foo_2 foo_3"), one("vertex_foo", &[0, 1, 2]));
        assert_eq!(names("q_x w_x"), [one("vertex_q", &[0]), one("vertex_w", &[1])].concat());
        for none in ["foo", "foo_q", "r g", "foo_x foo_y", "foo_u foo_v", "foo_red foo_green foo_blue", "foo_g"] {
            assert_eq!(names(none), [], "{none}");
        }
    }
}

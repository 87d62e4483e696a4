//! Attribute values: text to numbers, vectors, colours and spectra. Errors are messages; the caller knows the place.

use super::document::Spectrum;
use crate::spectrum::srgb_to_linear;
use glam::DVec3;

type Parsed<T> = Result<T, String>;

/// The words of a list; separated by white space and commas.
pub(crate) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty())
}

/// A finite number.
pub(crate) fn number(text: &str) -> Parsed<f64> {
    let value: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if value.is_finite() { Ok(value) } else { Err(format!("'{text}' is not a finite number")) }
}

/// A whole number.
pub(crate) fn integer(text: &str) -> Parsed<i64> {
    text.trim().parse().map_err(|_| format!("'{text}' is not an integer"))
}

/// `true` or `false`, in any case.
pub(crate) fn boolean(text: &str) -> Parsed<bool> {
    match text {
        _ if text.eq_ignore_ascii_case("true") => Ok(true),
        _ if text.eq_ignore_ascii_case("false") => Ok(false),
        _ => Err(format!("'{text}' is neither 'true' nor 'false'")),
    }
}

/// Finite numbers, at most `limit` of them.
pub(crate) fn numbers(text: &str, limit: usize) -> Parsed<Vec<f64>> {
    // One more than the limit is enough for the caller to see that there are too many.
    words(text).take(limit + 1).map(number).collect()
}

/// Three numbers.
pub(crate) fn vector(text: &str) -> Parsed<DVec3> {
    match numbers(text, 3)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("'{text}' is not three numbers")),
    }
}

/// Three numbers, or one for all three.
pub(crate) fn vector_or_scalar(text: &str) -> Parsed<DVec3> {
    match numbers(text, 3)?[..] {
        [v] => Ok(DVec3::splat(v)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("'{text}' is neither one number nor three")),
    }
}

/// Linear sRGB: three numbers, one for all three, or `#rrggbb` in the sRGB encoding. (Mitsuba 3.9 refuses the last.)
pub(crate) fn rgb(text: &str) -> Parsed<[f64; 3]> {
    if let Some(digits) = text.trim().strip_prefix('#') {
        let code = u32::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 6 && !digits.starts_with('+'));
        let code = code.ok_or_else(|| format!("'{text}' is not of the form #rrggbb"))?;
        return Ok([code >> 16, code >> 8, code].map(|byte| srgb_to_linear(f64::from(byte & 0xff) / 255.0)));
    }
    vector_or_scalar(text).map(|v| v.to_array())
}

/// One number, or `wavelength:value` pairs of ascending wavelengths.
pub(crate) fn spectrum(text: &str) -> Parsed<Spectrum> {
    let words: Vec<&str> = words(text).collect();
    if let [word] = words[..]
        && !word.contains(':')
    {
        return number(word).map(Spectrum::Uniform);
    }
    let pair = |word: &str| {
        let (nm, value) = word.split_once(':').ok_or_else(|| format!("'{word}' is not a wavelength:value pair"))?;
        Ok((number(nm)?, number(value)?))
    };
    table(words.into_iter().map(pair).collect::<Parsed<_>>()?).map(Spectrum::Table)
}

/// A spectrum file: a wavelength and a value a line, comments from `#` on. The line is 1-based.
pub(crate) fn spectrum_file(text: &str) -> Result<Vec<(f64, f64)>, (usize, String)> {
    let mut samples = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let data = line.split('#').next().unwrap_or("");
        match numbers(data, 2).map_err(|message| (i + 1, message))?[..] {
            [] => {}
            [nm, value] => samples.push((nm, value)),
            _ => return Err((i + 1, "expected a wavelength and a value".into())),
        }
    }
    table(samples).map_err(|message| (text.lines().count().max(1), message))
}

fn table(samples: Vec<(f64, f64)>) -> Parsed<Vec<(f64, f64)>> {
    if samples.len() < 2 {
        return Err("a spectrum needs at least two wavelengths".into());
    }
    match samples.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        Some(pair) => Err(format!("wavelengths must ascend, but {} comes before {}", pair[0].0, pair[1].0)),
        None => Ok(samples),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_finite_and_whole() {
        assert_eq!(number(" +0.5e1 "), Ok(5.0));
        for bad in ["", "1x", "nan", "inf", "1e999", "1 2"] {
            assert!(number(bad).is_err(), "{bad}");
        }
        assert_eq!(integer(" -3 "), Ok(-3));
        assert!(integer("3.0").is_err());
        assert_eq!(boolean("TRUE"), Ok(true));
        assert!(boolean("1").is_err());
    }

    #[test]
    fn lists_take_commas_and_spaces() {
        assert_eq!(vector("1, 2,3"), Ok(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(vector_or_scalar("2"), Ok(DVec3::splat(2.0)));
        assert!(vector("1 2").is_err());
        assert!(vector("1 2 3 4").is_err());
    }

    #[test]
    fn colours_may_be_hexadecimal() {
        assert_eq!(rgb("#ff0000"), Ok([1.0, 0.0, 0.0]));
        assert_eq!(rgb("0.25"), Ok([0.25; 3]));
        for bad in ["#ff00", "#gg0000", "#+f0000", "1 2"] {
            assert!(rgb(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn spectra_are_uniform_or_ascending_tables() {
        assert!(matches!(spectrum("0.5"), Ok(Spectrum::Uniform(0.5))));
        assert!(matches!(spectrum("400:1, 500:2"), Ok(Spectrum::Table(t)) if t == [(400.0, 1.0), (500.0, 2.0)]));
        for bad in ["", "0.5 0.6", "400:1", "500:1 400:2", "400:1 400:2", "400:1 500", "400 : 1"] {
            assert!(spectrum(bad).is_err(), "{bad}");
        }
        assert_eq!(spectrum_file("# n\n400 1\n\n500 2 # x\n"), Ok(vec![(400.0, 1.0), (500.0, 2.0)]));
        assert_eq!(spectrum_file("400 1\n500\n").unwrap_err().0, 2);
    }
}

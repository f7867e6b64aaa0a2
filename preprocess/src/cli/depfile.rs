//! Dependencies for make and ninja: what to bake again for.

use std::io;
use std::path::{Path, PathBuf};

/// Writes `output: inputs` to `path`, in the syntax both read. Every input is also a target without a rule, so
/// that make goes on where one was deleted.
pub(super) fn write(path: &Path, output: &Path, inputs: &[PathBuf]) -> io::Result<()> {
    let inputs: Vec<String> = inputs
        .iter()
        .map(|path| escape(path))
        .collect::<Result<_, _>>()?;
    let mut text = escape(output)? + ":";
    for input in &inputs {
        text += &format!(" \\\n  {input}");
    }
    text.push('\n');
    for input in &inputs {
        text += &format!("\n{input}:\n");
    }
    std::fs::write(path, text)
}

/// As GCC does it: `$$`, `\#`, and a backslash before white space, with those before it doubled.
fn escape(path: &Path) -> io::Result<String> {
    let text = path.to_str().ok_or_else(|| {
        io::Error::other(format!("{path:?} is not UTF-8, which no depfile can hold"))
    })?;
    let mut escaped = String::new();
    let mut backslashes = 0;
    for c in text.chars() {
        match c {
            '\n' | '\r' => {
                let what = format!("{text:?} has a line break, which no depfile can hold");
                return Err(io::Error::other(what));
            }
            ' ' | '\t' => escaped.extend((0..=backslashes).map(|_| '\\')),
            '#' => escaped.push('\\'),
            '$' => escaped.push('$'),
            _ => {}
        }
        escaped.push(c);
        backslashes = if c == '\\' { backslashes + 1 } else { 0 };
    }
    Ok(escaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_as_make_and_ninja_read_them() {
        let escaped = |text: &str| escape(Path::new(text)).unwrap();
        assert_eq!(escaped("a b/c#d$e.glb"), "a\\ b/c\\#d$$e.glb");
        assert_eq!(escaped("C:\\x\\ y"), "C:\\x\\\\\\ y");
        assert!(escape(Path::new("a\nb")).is_err());
    }
}

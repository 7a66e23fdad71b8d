//! Reading a table key by key: each read checks type and bounds, notes what is wrong and goes on.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::bounds::Bounds;
use super::mistake::Sheet;
use super::suggest::nearest;

/// A table of a TOML text, with the keys that were asked for. What was never asked for is unknown to the reader.
#[derive(Debug)]
pub struct Keys<'t> {
    table: &'t DeTable<'t>,
    span: Range<usize>,
    path: String,
    asked: Vec<&'static str>,
}

/// Parses a text, notes its errors of syntax, and hands out its top table for reading. The closure gets what could
/// be read, so that mistakes of both kinds are reported together.
pub fn with_top_table<T>(
    sheet: &mut Sheet<'_>,
    read: impl FnOnce(&mut Keys<'_>, &mut Sheet<'_>) -> T,
) -> T {
    let (table, errors) = DeTable::parse_recoverable(sheet.text());
    for error in &errors {
        let span = error.span().unwrap_or(0..0);
        sheet.fault(&span, "", error.message().trim());
    }
    let mut keys = Keys {
        table: table.get_ref(),
        span: 0..0,
        path: String::new(),
        asked: Vec::new(),
    };
    let value = read(&mut keys, sheet);
    // After an error of syntax the rest is a guess: an unknown key there would only repeat the error.
    if errors.is_empty() {
        keys.finish(sheet);
    }
    value
}

impl<'t> Keys<'t> {
    /// Where the table begins.
    pub const fn span(&self) -> &Range<usize> {
        &self.span
    }

    /// A key of this table with its path, as mistakes name it.
    pub fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        }
    }

    /// Where the value of a key stands; the table's own place when the key is not there.
    pub fn span_of(&self, key: &str) -> Range<usize> {
        self.entry(key)
            .map_or_else(|| self.span.clone(), Spanned::span)
    }

    /// Whether the key is there.
    pub fn has(&self, key: &str) -> bool {
        self.entry(key).is_some()
    }

    /// Notes a mistake in the value of a key.
    pub fn fault(&self, sheet: &mut Sheet<'_>, key: &str, message: impl Into<String>) {
        sheet.fault(&self.span_of(key), self.path_of(key), message);
    }

    /// Notes that a key must be there, unless it is.
    pub fn require(&mut self, sheet: &mut Sheet<'_>, key: &'static str, what: &str) {
        if self.ask(key).is_none() {
            self.fault(sheet, key, format!("is missing: give {what}"));
        }
    }

    /// Text.
    pub fn text(&mut self, sheet: &mut Sheet<'_>, key: &'static str) -> Option<String> {
        let value = self.ask(key)?;
        let text = value.get_ref().as_str();
        if text.is_none() {
            self.wrong_type(sheet, key, value, "text in quotes");
        }
        text.map(str::to_owned)
    }

    /// One of several words.
    pub fn choice(
        &mut self,
        sheet: &mut Sheet<'_>,
        key: &'static str,
        words: &[&'static str],
    ) -> Option<&'static str> {
        let text = self.text(sheet, key)?;
        let found = words.iter().copied().find(|word| *word == text);
        if found.is_none() {
            let hint = nearest(&text, words)
                .map_or_else(String::new, |word| format!("; did you mean {word:?}?"));
            self.fault(
                sheet,
                key,
                format!("is {text:?}; it must be one of {}{hint}", quoted(words)),
            );
        }
        found
    }

    /// `true` or `false`.
    pub fn flag(&mut self, sheet: &mut Sheet<'_>, key: &'static str) -> Option<bool> {
        let value = self.ask(key)?;
        let flag = value.get_ref().as_bool();
        if flag.is_none() {
            self.wrong_type(sheet, key, value, "true or false");
        }
        flag
    }

    /// A number within bounds.
    pub fn number(
        &mut self,
        sheet: &mut Sheet<'_>,
        key: &'static str,
        bounds: Bounds,
    ) -> Option<f64> {
        let value = self.ask(key)?;
        let Some(number) = number_of(value.get_ref()) else {
            self.wrong_type(sheet, key, value, "a number");
            return None;
        };
        if let Some(fault) = bounds.fault(number) {
            self.fault(sheet, key, fault);
            return None;
        }
        Some(number)
    }

    /// A whole number within bounds.
    pub fn whole(
        &mut self,
        sheet: &mut Sheet<'_>,
        key: &'static str,
        bounds: Bounds,
    ) -> Option<u32> {
        let number = self.number(sheet, key, bounds)?;
        if number.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&number) {
            self.fault(
                sheet,
                key,
                format!("is {number}; it must be a whole number"),
            );
            return None;
        }
        Some(number as u32)
    }

    /// A list of one to `n_max` whole numbers, each within bounds.
    pub fn wholes(
        &mut self,
        sheet: &mut Sheet<'_>,
        key: &'static str,
        bounds: Bounds,
        n_max: usize,
    ) -> Option<Vec<u32>> {
        let value = self.ask(key)?;
        let list = value
            .get_ref()
            .as_array()
            .filter(|list| (1..=n_max).contains(&list.len()));
        let Some(list) = list else {
            self.wrong_type(
                sheet,
                key,
                value,
                &format!("a list of 1 to {n_max} whole numbers"),
            );
            return None;
        };
        let mut wholes = Vec::new();
        for (index, element) in list.iter().enumerate() {
            let number = number_of(element.get_ref()).filter(|number| number.fract() == 0.0);
            let fault = match number {
                Some(number) => bounds.fault(number),
                None => Some("is no whole number".to_owned()),
            };
            match fault {
                Some(fault) => sheet.fault(
                    &element.span(),
                    format!("{}[{index}]", self.path_of(key)),
                    fault,
                ),
                None => wholes.extend(number.map(|number| number as u32)),
            }
        }
        (wholes.len() == list.len()).then_some(wholes)
    }

    /// A list of exactly `N` numbers, each within bounds; `shape` names them, e.g. `[x, y, z]`.
    pub fn numbers<const N: usize>(
        &mut self,
        sheet: &mut Sheet<'_>,
        key: &'static str,
        shape: &str,
        bounds: Bounds,
    ) -> Option<[f64; N]> {
        let value = self.ask(key)?;
        let list = value.get_ref().as_array().filter(|list| list.len() == N);
        let Some(list) = list else {
            self.wrong_type(sheet, key, value, &format!("{N} numbers {shape}"));
            return None;
        };
        let mut numbers = [0.0; N];
        let mut good = true;
        for (index, (slot, element)) in numbers.iter_mut().zip(list.iter()).enumerate() {
            let fault = match number_of(element.get_ref()) {
                Some(number) => {
                    *slot = number;
                    bounds.fault(number)
                }
                None => Some(format!(
                    "is {}; it must be a number",
                    element.get_ref().type_str()
                )),
            };
            if let Some(fault) = fault {
                sheet.fault(
                    &element.span(),
                    format!("{}[{index}]", self.path_of(key)),
                    fault,
                );
                good = false;
            }
        }
        good.then_some(numbers)
    }

    /// A list of texts, each with its place.
    pub fn texts(
        &mut self,
        sheet: &mut Sheet<'_>,
        key: &'static str,
    ) -> Option<Vec<(Range<usize>, String)>> {
        let value = self.ask(key)?;
        let Some(list) = value.get_ref().as_array() else {
            self.wrong_type(sheet, key, value, "a list of texts in brackets");
            return None;
        };
        let mut texts = Vec::new();
        for (index, element) in list.iter().enumerate() {
            match element.get_ref().as_str() {
                Some(text) => texts.push((element.span(), text.to_owned())),
                None => {
                    let key = format!("{}[{index}]", self.path_of(key));
                    sheet.fault(
                        &element.span(),
                        key,
                        format!("is {}; it must be text", element.get_ref().type_str()),
                    );
                }
            }
        }
        Some(texts)
    }

    /// A table of its own: `[key]`.
    pub fn table(&mut self, sheet: &mut Sheet<'_>, key: &'static str) -> Option<Self> {
        let value = self.ask(key)?;
        let Some(table) = value.get_ref().as_table() else {
            self.wrong_type(sheet, key, value, "a table");
            return None;
        };
        Some(Keys {
            table,
            span: value.span(),
            path: self.path_of(key),
            asked: Vec::new(),
        })
    }

    /// All tables of a list: `[[key]]`.
    pub fn tables(&mut self, sheet: &mut Sheet<'_>, key: &'static str) -> Vec<Self> {
        let Some(value) = self.ask(key) else {
            return Vec::new();
        };
        let Some(list) = value.get_ref().as_array() else {
            self.wrong_type(sheet, key, value, &format!("tables, each under [[{key}]]"));
            return Vec::new();
        };
        let mut tables = Vec::new();
        for (index, element) in list.iter().enumerate() {
            let path = format!("{}[{index}]", self.path_of(key));
            match element.get_ref().as_table() {
                Some(table) => tables.push(Keys {
                    table,
                    span: element.span(),
                    path,
                    asked: Vec::new(),
                }),
                None => sheet.fault(&element.span(), path, "is no table"),
            }
        }
        tables
    }

    /// Notes every key that nobody asked for.
    pub fn finish(&self, sheet: &mut Sheet<'_>) {
        for key in self
            .table
            .keys()
            .filter(|key| !self.asked.contains(&key.get_ref().as_ref()))
        {
            let hint = nearest(key.get_ref(), &self.asked).map_or_else(
                || format!("; known are {}", self.asked.join(", ")),
                |known| format!("; did you mean {known}?"),
            );
            sheet.fault(
                &key.span(),
                self.path_of(key.get_ref()),
                format!("is no known key{hint}"),
            );
        }
    }

    fn ask(&mut self, key: &'static str) -> Option<&'t Spanned<DeValue<'t>>> {
        if !self.asked.contains(&key) {
            self.asked.push(key);
        }
        self.entry(key)
    }

    fn entry(&self, key: &str) -> Option<&'t Spanned<DeValue<'t>>> {
        self.table
            .iter()
            .find(|(name, _)| name.get_ref() == key)
            .map(|(_, value)| value)
    }

    fn wrong_type(
        &self,
        sheet: &mut Sheet<'_>,
        key: &str,
        value: &Spanned<DeValue<'_>>,
        wanted: &str,
    ) {
        let given = match value.get_ref() {
            DeValue::Array(list) => format!("a list of {}", list.len()),
            DeValue::String(_) => "text".to_owned(),
            other => format!("a {}", other.type_str()),
        };
        self.fault(sheet, key, format!("is {given}; it must be {wanted}"));
    }
}

/// The value of a whole or broken number.
fn number_of(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(whole) => i64::from_str_radix(whole.as_str(), whole.radix())
            .ok()
            .map(|whole| whole as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

fn quoted(words: &[&str]) -> String {
    words
        .iter()
        .map(|word| format!("{word:?}"))
        .collect::<Vec<_>>()
        .join(", ")
}

//! SPEC.toml.

use lenze9300_model::FileError;
use lenze9300_model::toml_file::Reader;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table};

use super::layout::{self, Layout, Range, Scale, Span};
use super::parameter::{self, Setting};
use crate::catalogue::Catalogue;
use crate::machine_file::MachineFile;
use crate::toml_section::Section;

/// What to vary, and how. The format is described at [`crate::sweep`].
///
/// ```
/// use film_feed::sweep::SweepSpec;
///
/// let text = "layout = \"grid\"\n[[parameter]]\nname = \"feed.speed_mm_s\"\nfrom = 600\nto = 1200\nsteps = 4\n";
/// let spec = SweepSpec::read(text, |_| Err("no other file is needed".to_owned()))?;
/// assert_eq!(spec.points(), 4);
/// let wrong = SweepSpec::read(&text.replace("steps", "step"), |_| Err(String::new())).unwrap_err();
/// assert_eq!(wrong.to_string(), "line 2: parameter.steps is missing; expected is a whole number from 2 to 1000000");
/// # Ok::<(), lenze9300_model::FileError>(())
/// ```
#[derive(Debug, Clone)]
pub struct SweepSpec {
    pub(super) machine: Table,
    pub(super) catalogue: Catalogue,
    pub(super) feeds: u32,
    pub(super) seed: u32,
    pub(super) seeds: Seeds,
    layout: Layout,
    pub(super) set: Vec<(String, Setting)>,
    pub(super) parameters: Vec<Parameter>,
    fingerprint: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seeds {
    /// Every machine has its own.
    Each,
    /// All have the same.
    Same,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) range: Range,
}

/// The axis of the thesis.
const THESIS: &str = include_str!("../../../docs/examples/machine.toml");

/// Most points of a sweep.
const MOST_POINTS: u64 = 1_000_000;

/// Points of the Sobol sequence; `sobol_burley` has no more.
const MOST_RANDOM_POINTS: i64 = 65_536;

/// Dimensions of the Sobol sequence.
const MOST_PARAMETERS: usize = sobol_burley::NUM_DIMENSIONS as usize;

impl SweepSpec {
    /// Reads a SPEC.toml; `fetch` gets the text of the MACHINE.toml and the catalogue that it names, and says in a sentence why it cannot.
    ///
    /// # Errors
    /// [`FileError`] with every mistake of the SPEC; a machine with mistakes is one of them. Whether all points are possible tells
    /// [`check`](super::check).
    pub fn read(text: &str, mut fetch: impl FnMut(&str) -> Result<String, String>) -> Result<Self, FileError> {
        Reader::read(text, |reader, table| read(reader, table, text, &mut fetch))
    }

    /// How many points there are.
    pub fn points(&self) -> u64 {
        layout::points(self.layout, &self.ranges()).unwrap_or(0)
    }

    /// Feeds of a machine.
    pub fn feeds(&self) -> u32 {
        self.feeds
    }

    /// Names of the parameters that are varied, in their order.
    pub fn parameters(&self) -> impl Iterator<Item = &str> {
        self.parameters.iter().map(|parameter| parameter.name.as_str())
    }

    /// Sixteen hexadecimal digits that differ when SPEC or machine differ; results with the same ones belong together.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// The value of each parameter at a point, numbered from 1.
    pub fn settings(&self, point: u64) -> Vec<Setting> {
        layout::values(self.layout, &self.ranges(), self.seed, point.saturating_sub(1))
    }

    fn ranges(&self) -> Vec<&Range> {
        self.parameters.iter().map(|parameter| &parameter.range).collect()
    }
}

fn read<'a>(
    reader: &mut Reader<'a>,
    table: &DeTable<'a>,
    text: &str,
    fetch: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Option<SweepSpec> {
    let mut top = Section::new(reader, table, "", 0..0);
    let machine_at = top.take("machine");
    let catalogue_at = top.take("catalogue");
    let words = [("grid", Word::Grid), ("random", Word::Random), ("list", Word::List)];
    let word = top.choice("layout", &words, Word::Grid);
    let count = top.take("count");
    let feeds = top.whole("feeds", 1..=1000, 10) as u32;
    let seed = top.whole("seed", 0..=i64::from(u32::MAX), 1) as u32;
    let seeds = top.choice("seeds", &[("each", Seeds::Each), ("same", Seeds::Same)], Seeds::Each);
    let set = top.take("set");
    let parameters = top.take("parameter");
    if parameters.is_none() {
        top.mistake(None, "there is no [[parameter]]; name at least one that is varied");
    }
    let layout = match word {
        Word::Grid => Layout::Grid,
        Word::List => Layout::List,
        Word::Random => Layout::Random {
            count: match count {
                Some(value) => top.reader().number(value, "count", 1..=MOST_RANDOM_POINTS).unwrap_or(1) as u32,
                None => {
                    top.missing("count", &format!("a whole number from 1 to {MOST_RANDOM_POINTS}"));
                    1
                }
            },
        },
    };
    if count.is_some() && word != Word::Random {
        top.mistake(count, "count: only a random layout has one; leave it out");
    }
    top.finish();

    let (catalogue, catalogue_text) = read_catalogue(reader, catalogue_at, fetch);
    let (machine, machine_text) = read_machine(reader, machine_at, &catalogue, fetch);
    let set = set.map_or_else(Vec::new, |value| read_set(reader, value));
    let parameters = match parameters {
        Some(value) => read_parameters(reader, value, layout),
        None => Vec::new(),
    };
    for (n, parameter) in parameters.iter().enumerate() {
        let twice = parameters[..n].iter().any(|other| other.name == parameter.name);
        if twice || set.iter().any(|(name, _)| *name == parameter.name) {
            reader.mistake(0..0, format!("{} is given twice", parameter.name));
        }
    }
    if let Layout::List = layout {
        let lengths: Vec<u64> = parameters.iter().map(|parameter| parameter.range.len()).collect();
        if lengths.windows(2).any(|pair| pair[0] != pair[1]) {
            reader.mistake(
                0..0,
                format!("in a list all parameters have as many values, here they have {lengths:?}"),
            );
        }
    }
    let spec = SweepSpec {
        machine: machine?,
        catalogue,
        feeds,
        seed,
        seeds,
        layout,
        set,
        parameters,
        fingerprint: fingerprint(&[env!("CARGO_PKG_VERSION"), text, &machine_text, &catalogue_text]),
    };
    let points = layout::points(layout, &spec.ranges());
    if points.is_none_or(|points| points > MOST_POINTS) {
        reader.mistake(
            0..0,
            format!("the grid has more than {MOST_POINTS} points; take fewer steps"),
        );
    }
    Some(spec)
}

/// A layout as the file names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Grid,
    Random,
    List,
}

/// The built-in catalogue with what the file adds, and the text of that.
fn read_catalogue<'a>(
    reader: &mut Reader<'a>,
    at: Option<&Spanned<DeValue<'a>>>,
    fetch: &mut dyn FnMut(&str) -> Result<String, String>,
) -> (Catalogue, String) {
    let mut catalogue = Catalogue::built_in();
    let Some(value) = at else {
        return (catalogue, String::new());
    };
    let Some(path) = reader.text(value, "catalogue") else {
        return (catalogue, String::new());
    };
    let read = fetch(path).and_then(|text| {
        let more = Catalogue::read(&text).map_err(|error| error.to_string())?;
        Ok((more, text))
    });
    match read {
        Ok((more, text)) => {
            catalogue.add(more);
            (catalogue, text)
        }
        Err(why) => {
            reader.mistake(value.span(), format!("catalogue: {why}"));
            (catalogue, String::new())
        }
    }
}

/// The machine as a tree, and its text.
fn read_machine<'a>(
    reader: &mut Reader<'a>,
    at: Option<&Spanned<DeValue<'a>>>,
    catalogue: &Catalogue,
    fetch: &mut dyn FnMut(&str) -> Result<String, String>,
) -> (Option<Table>, String) {
    let mistake = |reader: &mut Reader<'a>, what: String| {
        reader.mistake(at.map_or(0..0, Spanned::span), what);
        (None, String::new())
    };
    let text = match at {
        None => THESIS.to_owned(),
        Some(value) => {
            let Some(path) = reader.text(value, "machine") else {
                return (None, String::new());
            };
            match fetch(path) {
                Ok(text) => text,
                Err(why) => return mistake(reader, format!("machine: {why}")),
            }
        }
    };
    if let Err(error) = MachineFile::read(&text, catalogue) {
        return mistake(reader, format!("machine: {error}"));
    }
    match text.parse() {
        Ok(table) => (Some(table), text),
        Err(error) => mistake(reader, format!("machine: {error}")),
    }
}

fn read_set<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>) -> Vec<(String, Setting)> {
    let Some(table) = reader.table(value, "set") else {
        return Vec::new();
    };
    let mut set = Vec::new();
    for (name, value) in table {
        match value.get_ref().as_table() {
            Some(inner) => {
                for (key, value) in inner {
                    set.push((format!("{}.{}", name.get_ref(), key.get_ref()), value));
                }
            }
            None => set.push((name.get_ref().to_string(), value)),
        }
    }
    set.into_iter()
        .filter_map(|(name, value)| {
            if let Err(what) = parameter::place(&name) {
                reader.mistake(value.span(), format!("set: {what}"));
                return None;
            }
            let setting = read_setting(reader, value, &name)?;
            Some((name, setting))
        })
        .collect()
}

fn read_parameters<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, layout: Layout) -> Vec<Parameter> {
    let tables = reader.tables(value, "parameter");
    if tables.len() > MOST_PARAMETERS {
        reader.mistake(
            value.span(),
            format!(
                "there are {} parameters, at most {MOST_PARAMETERS} are allowed",
                tables.len()
            ),
        );
    }
    tables
        .into_iter()
        .filter_map(|(at, table)| {
            let mut section = Section::new(reader, table, "parameter", at.span());
            let parameter = read_parameter(&mut section, layout);
            section.finish();
            parameter
        })
        .collect()
}

fn read_parameter(section: &mut Section<'_, '_, '_>, layout: Layout) -> Option<Parameter> {
    let name_at = section.take("name");
    let name = name_at.and_then(|value| section.reader().text(value, "parameter.name"));
    if name_at.is_none() {
        section.missing("name", "the dotted name of what is varied, such as \"feed.speed_mm_s\"");
    }
    if let Some(Err(what)) = name.map(parameter::place) {
        section.mistake(name_at, format!("parameter.name: {what}"));
    }
    let range = match section.take("values") {
        Some(values) => read_values(section, values).map(Range::Values),
        None if layout == Layout::List => {
            section.missing("values", "a list of numbers or texts");
            None
        }
        None => read_span(section, name.unwrap_or_default(), layout).map(Range::Span),
    };
    Some(Parameter {
        name: name?.to_owned(),
        range: range?,
    })
}

fn read_values<'a>(section: &mut Section<'_, '_, 'a>, values: &Spanned<DeValue<'a>>) -> Option<Vec<Setting>> {
    let array = values.get_ref().as_array();
    let array = array.filter(|array| !array.is_empty());
    let Some(array) = array else {
        section.mistake(
            Some(values),
            "parameter.values: expected a list of numbers or texts with at least one",
        );
        return None;
    };
    array
        .iter()
        .map(|value| read_setting(section.reader(), value, "parameter.values"))
        .collect()
}

fn read_span(section: &mut Section<'_, '_, '_>, name: &str, layout: Layout) -> Option<Span> {
    let any = -1e12..=1e12;
    let from = section.real("from", any.clone(), None);
    let to = section.real("to", any, None);
    let steps = match layout {
        Layout::Grid => section.whole("steps", 2..=MOST_POINTS as i64, None) as u32,
        _ => 2,
    };
    let scale = section.choice(
        "scale",
        &[("linear", Scale::Linear), ("log", Scale::Log)],
        Scale::Linear,
    );
    let step = section.real("step", 1e-12..=1e12, parameter::step(name));
    if !section.is_sound() {
        return None;
    }
    if scale == Scale::Log && !(from > 0.0 && to > 0.0) {
        section.mistake(
            None,
            format!("parameter.scale: \"log\" needs from and to above 0, got {from} and {to}"),
        );
    }
    Some(Span {
        from,
        to,
        steps,
        scale,
        step,
    })
}

/// A number or a text.
fn read_setting<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>, what: &str) -> Option<Setting> {
    match value.get_ref() {
        DeValue::String(_) => reader.text(value, what).map(|text| Setting::Word(text.to_owned())),
        DeValue::Integer(_) | DeValue::Float(_) => reader.real(value, what, -1e15..=1e15).map(Setting::Number),
        _ => {
            reader.wrong_type(value, what, "a number or a text");
            None
        }
    }
}

/// FNV-1a over the parts, 64 bits (Fowler, Noll, Vo; RFC 9923): short, the same everywhere, and not meant against malice.
fn fingerprint(parts: &[&str]) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for part in parts {
        // The end of a part counts, too.
        for octet in part.bytes().chain([0xFF]) {
            hash = (hash ^ u64::from(octet)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    format!("{hash:016x}")
}

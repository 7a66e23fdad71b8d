//! Open Sound Control 1.0: messages, alone or in bundles. Numbers are big-endian, texts end in NUL, everything is padded
//! to four bytes.

/// Bundles within bundles that are looked into; senders use one.
const MAX_DEPTH: u32 = 4;
/// What a bundle begins with; a time tag of eight bytes follows.
const BUNDLE: &[u8; 8] = b"#bundle\0";

/// Why bytes are no OSC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Malformed {
    /// It ends in the middle of something.
    Short,
    /// A text has no end, is not padded or is not UTF-8.
    Text,
    /// A message's address begins with no slash.
    Address,
    /// An element of a bundle has a size that is negative, no multiple of four, or beyond the end.
    Size,
    /// Bundles in bundles in bundles.
    Depth,
    /// The type of an argument is not known, so that what follows it cannot be found.
    Type,
}

impl Malformed {
    /// In words.
    pub(crate) const fn text(self) -> &'static str {
        match self {
            Self::Short => "OSC that ends too early",
            Self::Text => "OSC with a broken text",
            Self::Address => "no OSC address",
            Self::Size => "an OSC bundle with a wrong size",
            Self::Depth => "OSC bundles nested too deep",
            Self::Type => "OSC with an unknown type",
        }
    }
}

/// One argument of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Argument<'a> {
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A text.
    Text(&'a str),
    /// Something else, skipped.
    Other,
}

impl Argument<'_> {
    /// It as a number, if it is one.
    pub(crate) const fn number(&self) -> Option<f64> {
        match self {
            Self::Whole(whole) => Some(*whole as f64),
            Self::Number(number) => Some(*number),
            Self::Text(_) | Self::Other => None,
        }
    }
}

/// One message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Message<'a> {
    /// Its address, such as `/VMC/Ext/T`.
    pub(crate) address: &'a str,
    tags: &'a [u8],
    data: &'a [u8],
}

impl<'a> Message<'a> {
    /// Its arguments; the last one is an error if they end too early or one is of no known type.
    pub(crate) fn arguments(&self) -> Arguments<'a> {
        Arguments {
            tags: self.tags,
            data: self.data,
        }
    }
}

/// The arguments of a message, one by one.
#[derive(Debug, Clone)]
pub(crate) struct Arguments<'a> {
    tags: &'a [u8],
    data: &'a [u8],
}

impl<'a> Iterator for Arguments<'a> {
    type Item = Result<Argument<'a>, Malformed>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let (tag, tags) = self.tags.split_first()?;
            self.tags = tags;
            // Brackets around an array carry no data.
            if !matches!(tag, b'[' | b']') {
                let argument = argument(*tag, &mut self.data);
                if argument.is_err() {
                    self.tags = &[];
                }
                return Some(argument);
            }
        }
    }
}

fn argument<'a>(tag: u8, data: &mut &'a [u8]) -> Result<Argument<'a>, Malformed> {
    Ok(match tag {
        b'i' => Argument::Whole(i32::from_be_bytes(array(data)?).into()),
        b'h' => Argument::Whole(i64::from_be_bytes(array(data)?)),
        b'f' => Argument::Number(f32::from_be_bytes(array(data)?).into()),
        b'd' => Argument::Number(f64::from_be_bytes(array(data)?)),
        b's' | b'S' => Argument::Text(text(data)?),
        b'b' => {
            let size = i32::from_be_bytes(array(data)?);
            let size = usize::try_from(size).map_err(|_negative| Malformed::Size)?;
            take(data, size.next_multiple_of(4))?;
            Argument::Other
        }
        b't' => {
            take(data, 8)?;
            Argument::Other
        }
        b'c' | b'r' | b'm' => {
            take(data, 4)?;
            Argument::Other
        }
        b'T' => Argument::Whole(1),
        b'F' => Argument::Whole(0),
        b'N' | b'I' => Argument::Other,
        _ => return Err(Malformed::Type),
    })
}

/// Calls `visit` with every message of a datagram, in order.
pub(crate) fn visit_messages<'a>(
    datagram: &'a [u8],
    visit: &mut dyn FnMut(Message<'a>) -> Result<(), Malformed>,
) -> Result<(), Malformed> {
    visit_element(datagram, 0, visit)
}

fn visit_element<'a>(
    element: &'a [u8],
    depth: u32,
    visit: &mut dyn FnMut(Message<'a>) -> Result<(), Malformed>,
) -> Result<(), Malformed> {
    let Some(bundled) = element.strip_prefix(BUNDLE) else {
        return visit(message(element)?);
    };
    if depth == MAX_DEPTH {
        return Err(Malformed::Depth);
    }
    let mut rest = bundled;
    take(&mut rest, 8)?;
    while !rest.is_empty() {
        let size = i32::from_be_bytes(array(&mut rest)?);
        let size = usize::try_from(size).map_err(|_negative| Malformed::Size)?;
        if size % 4 != 0 || size > rest.len() {
            return Err(Malformed::Size);
        }
        let inner = take(&mut rest, size)?;
        visit_element(inner, depth + 1, visit)?;
    }
    Ok(())
}

fn message(mut bytes: &[u8]) -> Result<Message<'_>, Malformed> {
    if bytes.is_empty() {
        return Err(Malformed::Short);
    }
    if bytes[0] != b'/' {
        return Err(Malformed::Address);
    }
    let address = text(&mut bytes)?;
    // Old senders leave the types out where there are no arguments.
    let tags = if bytes.is_empty() {
        ""
    } else {
        text(&mut bytes)?
    };
    let tags = match tags.strip_prefix(',') {
        Some(tags) => tags,
        None if tags.is_empty() => "",
        None => return Err(Malformed::Type),
    };
    Ok(Message {
        address,
        tags: tags.as_bytes(),
        data: bytes,
    })
}

fn take<'a>(bytes: &mut &'a [u8], n_bytes: usize) -> Result<&'a [u8], Malformed> {
    let (taken, rest) = bytes.split_at_checked(n_bytes).ok_or(Malformed::Short)?;
    *bytes = rest;
    Ok(taken)
}

fn array<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], Malformed> {
    let (taken, rest) = bytes.split_first_chunk::<N>().ok_or(Malformed::Short)?;
    *bytes = rest;
    Ok(*taken)
}

fn text<'a>(bytes: &mut &'a [u8]) -> Result<&'a str, Malformed> {
    let end = bytes
        .iter()
        .position(|byte| *byte == 0)
        .ok_or(Malformed::Text)?;
    // At least one NUL, up to four.
    let padded = take(bytes, (end + 1).next_multiple_of(4)).map_err(|_short| Malformed::Text)?;
    std::str::from_utf8(&padded[..end]).map_err(|_utf8| Malformed::Text)
}

/// A message as bytes, for emulators.
#[derive(Debug, Clone)]
pub(crate) struct Writer {
    address: Vec<u8>,
    tags: Vec<u8>,
    data: Vec<u8>,
}

impl Writer {
    /// A message without arguments.
    pub(crate) fn to(address: &str) -> Self {
        Self {
            address: padded(address),
            tags: b",".to_vec(),
            data: Vec::new(),
        }
    }

    /// With a text.
    pub(crate) fn text(mut self, text: &str) -> Self {
        self.tags.push(b's');
        self.data.extend(padded(text));
        self
    }

    /// With a whole number.
    pub(crate) fn whole(mut self, whole: i32) -> Self {
        self.tags.push(b'i');
        self.data.extend(whole.to_be_bytes());
        self
    }

    /// With numbers.
    pub(crate) fn numbers(mut self, numbers: &[f64]) -> Self {
        for number in numbers {
            self.tags.push(b'f');
            self.data.extend((*number as f32).to_be_bytes());
        }
        self
    }

    /// Its bytes.
    pub(crate) fn bytes(mut self) -> Vec<u8> {
        self.tags.push(0);
        self.tags.resize(self.tags.len().next_multiple_of(4), 0);
        [self.address, self.tags, self.data].concat()
    }
}

/// A bundle of messages, to be taken at once.
pub(crate) fn bundle(messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = BUNDLE.to_vec();
    // The time tag that means "now".
    bytes.extend([0, 0, 0, 0, 0, 0, 0, 1]);
    for message in messages {
        bytes.extend((message.len() as u32).to_be_bytes());
        bytes.extend(message);
    }
    bytes
}

fn padded(text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize((bytes.len() + 1).next_multiple_of(4), 0);
    bytes
}

#[cfg(test)]
mod tests {
    use super::{Argument, Malformed, Writer, bundle, visit_messages};

    /// Addresses and arguments as text.
    fn read(datagram: &[u8]) -> Result<Vec<String>, Malformed> {
        let mut found = Vec::new();
        visit_messages(datagram, &mut |message| {
            let arguments: Vec<Argument<'_>> = message.arguments().collect::<Result<_, _>>()?;
            found.push(format!("{} {arguments:?}", message.address));
            Ok(())
        })?;
        Ok(found)
    }

    /// The two examples of the OSC 1.0 specification.
    #[test]
    fn the_examples_of_the_specification_decode() {
        let first = b"/oscillator/4/frequency\0,f\0\0\x43\xdc\0\0";
        assert_eq!(
            read(first).unwrap(),
            ["/oscillator/4/frequency [Number(440.0)]"]
        );
        let second = b"/foo\0\0\0\0,iisff\0\0\0\0\x03\xe8\xff\xff\xff\xffhello\0\0\0\x3f\x9d\xf3\xb6\x40\xb5\xb2\x2d";
        let found = read(second).unwrap();
        assert!(
            found[0].starts_with("/foo [Whole(1000), Whole(-1), Text(\"hello\"), Number(1.23"),
            "{found:?}"
        );
    }

    #[test]
    fn what_is_written_is_read() {
        let messages = [
            Writer::to("/VMC/Ext/OK").whole(1).bytes(),
            Writer::to("/VMC/Ext/T").numbers(&[1.5]).bytes(),
            Writer::to("/a").text("abc").text("abcd").bytes(),
        ];
        assert_eq!(
            read(&bundle(&messages)).unwrap(),
            [
                "/VMC/Ext/OK [Whole(1)]",
                "/VMC/Ext/T [Number(1.5)]",
                "/a [Text(\"abc\"), Text(\"abcd\")]",
            ]
        );
        assert_eq!(
            read(&bundle(&[bundle(&messages[..1])])).unwrap(),
            ["/VMC/Ext/OK [Whole(1)]"]
        );
    }

    #[test]
    fn what_is_broken_has_a_name() {
        let whole = Writer::to("/VMC/Ext/T").numbers(&[1.5]).bytes();
        for (bytes, fault) in [
            (b"".to_vec(), Malformed::Short),
            (whole[..whole.len() - 1].to_vec(), Malformed::Short),
            (b"/VMC".to_vec(), Malformed::Text),
            (b"/\xff\0\0".to_vec(), Malformed::Text),
            (b"VMC\0".to_vec(), Malformed::Address),
            (b"/a\0\0,x\0\0".to_vec(), Malformed::Type),
            (b"/a\0\0abc\0".to_vec(), Malformed::Type),
            (b"#bundle\0\0\0\0\0".to_vec(), Malformed::Short),
            (
                b"#bundle\0\0\0\0\0\0\0\0\x01\xff\xff\xff\xff".to_vec(),
                Malformed::Size,
            ),
            (
                b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\0\x09/a\0\0,\0\0\0".to_vec(),
                Malformed::Size,
            ),
            (
                (0..6).fold(whole, |inner, _| bundle(&[inner])),
                Malformed::Depth,
            ),
        ] {
            assert_eq!(read(&bytes), Err(fault), "{bytes:?}");
        }
    }
}

use super::*;
use crate::io::roundtrip;
use proptest::prelude::*;

fn read_bytes(text: &[u8]) -> Result<(Molecule, Vec<Warning>), Fault> {
    let source = Source::from_bytes("test.pdb", text.to_vec()).expect("bytes");
    let mut warnings = Vec::new();
    let molecule = read(&source, &mut warnings).map_err(Refusal::fault)?;
    molecule.check()?;
    Ok((molecule, warnings))
}

fn molecule(text: &str) -> Molecule {
    read_bytes(text.as_bytes()).expect("a molecule").0
}

fn message(text: &str) -> String {
    read_bytes(text.as_bytes())
        .expect_err("a fault")
        .to_string()
}

/// A line with some of its columns, counted from 1, replaced.
fn with(column: usize, text: &str) -> String {
    let line = "ATOM   1017  CA AHIS A  52      11.104   6.134  -6.504  0.50 17.35           C  ";
    let from = column - 1;
    format!("{}{text}{}", &line[..from], &line[from + text.len()..])
}

#[test]
fn all_columns_are_read() {
    let found = molecule(&with(27, "A"));
    let atom = found.atoms[0];
    let expected = Atom {
        position: [11.104, 6.134, -6.504],
        serial: 1017,
        name: Name::new(b"CA").expect("a name"),
        occupancy: 0.5,
        b_factor: 17.35,
        element: Element(6),
        altloc: b'A',
        ..BLANK
    };
    assert_eq!(atom, expected);
    let residue = &found.residues[0];
    assert_eq!(
        (residue.to_string(), residue.name.as_str()),
        ("A:52A".into(), "HIS")
    );
    assert_eq!((found.models.len(), found.models[0].number), (1, 1));
}

#[test]
fn lines_may_be_short_and_end_in_any_way() {
    let short = &with(17, " ")[..54];
    for text in [
        short.to_owned(),
        format!("{short}\r\n"),
        format!("{short}\r{short}\r"),
    ] {
        let (found, warnings) = read_bytes(text.as_bytes()).expect("a molecule");
        assert_eq!(
            (found.atoms[0].occupancy, found.atoms[0].element),
            (1.0, Element(6))
        );
        assert_eq!(found.atoms[0].altloc, b' ');
        assert_eq!(&*warnings[0].code, "guessed-elements");
    }
    let shorter = &with(47, " -7.0   ")[..51];
    assert_eq!(molecule(shorter).atoms[0].position[2], -7.0);
}

#[test]
fn numbers_that_outgrow_their_columns_are_read() {
    let serial = |text: &str| molecule(text).atoms[0].serial;
    assert_eq!(serial(&with(7, "A0000")), 100_000);
    assert_eq!(serial(&with(6, "100000")), 100_000);
    assert_eq!(serial(&with(7, "186a0")), 100_000);
    assert_eq!(serial(&with(1, "HETATM123456")), 123_456);
    let number = |text: &str| molecule(text).residues[0].number;
    assert_eq!(number(&with(23, "A000")), 10_000);
    assert_eq!(number(&with(23, "10000")), 10_000);
    assert_eq!(number(&with(23, " -12")), -12);
    let wide = molecule(&with(31, "100000.0-12345.699999.99"));
    assert_eq!(wide.atoms[0].position, [1e5, -12345.6, 99999.99]);
    let long = molecule(&with(18, "TIP3W"));
    assert_eq!(
        (
            long.residues[0].name.as_str(),
            long.residues[0].chain.as_str()
        ),
        ("TIP3", "W")
    );
}

#[test]
fn lost_numbers_are_counted() {
    let lines = [
        with(7, "99999"),
        with(7, "*****"),
        with(7, "     "),
        with(55, "************"),
    ];
    let (found, warnings) = read_bytes(lines.join("\n").as_bytes()).expect("a molecule");
    let serials: Vec<i64> = found.atoms.iter().map(|atom| atom.serial).collect();
    assert_eq!(serials, [99_999, 100_000, 100_001, 1017]);
    assert_eq!(
        (found.atoms[3].occupancy, found.atoms[3].b_factor),
        (1.0, 0.0)
    );
    let codes: Vec<_> = warnings
        .iter()
        .map(|w| (&*w.code, w.count, w.first))
        .collect();
    assert_eq!(
        codes,
        [("lost-serials", 2, Some(2)), ("lost-figures", 2, Some(4))]
    );
}

#[test]
fn models_end_with_their_records() {
    let atom = with(7, "    1");
    let numbers = |text: &str| -> Vec<(i32, u32)> {
        let found = molecule(text);
        let models = found.models.iter();
        models
            .map(|m| (m.number, m.atoms.end - m.atoms.start))
            .collect()
    };
    let text =
        format!("MODEL        3   1GRM 118\n{atom}\n{atom}\nENDMDL\nMODEL\n{atom}\nENDMDL\nEND\n");
    assert_eq!(numbers(&text), [(3, 2), (4, 1)]);
    let text = format!("{atom}\nTER\n{atom}\nEND\n{atom}\nEND\nMODEL 9\nEND\n");
    assert_eq!(numbers(&text), [(1, 2), (2, 1)]);
    let split = molecule(&format!("{atom}\nTER\n{atom}\n"));
    assert_eq!(split.residues.len(), 2);
}

#[test]
fn records_name_the_entry_and_modified_residues() {
    let head = format!(
        "{:<62}1ATP\nMODRES 1ATP HIS A   52  HIS\nMODRES ?\n",
        "HEADER    KINASE"
    );
    let found = molecule(&(head + &with(7, "    1") + "\n" + &with(27, "B")));
    assert_eq!(found.id, "1ATP");
    let flags: Vec<bool> = found.residues.iter().map(|r| r.in_polymer).collect();
    assert_eq!(flags, [true, false]);
}

#[test]
fn faults_name_the_line_and_the_columns() {
    let after = |text: &str| message(&format!("REMARK\n{text}\n"));
    assert_eq!(
        after(&with(1, "ATOM")[..46]),
        "2: ends at column 46, but coordinates stand in columns 31 to 54"
    );
    assert_eq!(
        after(&with(31, "  11.1o4")),
        "2: x in columns 31 to 38 is \"11.1o4\", which is no number"
    );
    assert_eq!(
        after(&with(39, "     nan")),
        "2: y in columns 39 to 46 is \"nan\", which is not finite"
    );
    assert_eq!(
        after(&with(47, "   1e999")),
        "2: z in columns 47 to 54 is \"1e999\", which is not finite"
    );
    assert_eq!(
        after(&with(31, "        ")),
        "2: x in columns 31 to 38 is \"\", which is no number"
    );
    assert_eq!(
        after(&with(7, " 1x17")),
        "2: the serial number \"1x17\" is none"
    );
    assert_eq!(
        after(&with(23, "****")),
        "2: the residue number \"****\" is none"
    );
    assert_eq!(
        after(&with(55, "  0.5x")),
        "2: the occupancy \"0.5x\" is no number"
    );
    assert_eq!(
        after(&with(61, "  1e99")),
        "2: the temperature factor \"1e99\" is not finite"
    );
    assert_eq!(
        after(&with(17, "\t")),
        "2: the alternative \"\\t\" is no printable character"
    );
    assert_eq!(after("MODEL x"), "2: the model number \"x\" is none");
    assert_eq!(message("HEADER\n"), "holds no atoms");
}

#[test]
fn atoms_take_no_more_than_they_may() {
    let text = (with(7, "    1") + "\n").repeat(100);
    let source = Source::from_bytes("test.pdb", text.into_bytes()).expect("bytes");
    let limit = 10 * size_of::<Atom>() as u64;
    let mut reader = Reader::new(Gathered::new(8100, ROW, limit));
    let line = with(7, "    1");
    let refusal = (0..).find_map(|_| reader.atom(line.as_bytes(), 1, false).err());
    assert!(
        matches!(refusal, Some(Refusal::OverMemory { .. })),
        "{refusal:?}"
    );
    assert_eq!(reader.gathered.builder.len(), 10);
    assert_eq!(
        read(&source, &mut Vec::new()).expect("room").atoms.len(),
        100
    );
}

fn written(molecule: &Molecule) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(molecule, &mut bytes).expect("it fits");
    bytes
}

#[test]
fn what_does_not_fit_is_refused_and_says_where_it_would() {
    let sound = molecule(&with(7, "    1"));
    assert_eq!(refusal(&sound), None);
    let why = |change: fn(&mut Molecule)| {
        let mut other = sound.clone();
        change(&mut other);
        refusal(&other).expect("a refusal")
    };
    assert_eq!(
        why(|m| m.atoms[0].position[1] = 1e4),
        "does not hold it: atom 0 has the coordinate 10000, which does not fit 8 columns; cif does"
    );
    assert_eq!(
        why(|m| m.residues[0].chain = Name::new(b"AA").expect("a name")),
        "does not hold it: residue HIS AA:52 has the chain \"AA\", longer than 1 columns; cif does"
    );
    assert_eq!(
        why(|m| m.atoms[0].serial = 1 << 40),
        "does not hold it: atom 0 has the serial number 1099511627776, which does not fit 5 columns; cif does"
    );
    assert!(why(|m| m.atoms[0].name = Name::new(b"HO5''").expect("a name")).contains("4 columns"));
    assert!(why(|m| m.residues[0].number = i32::MAX).contains("a number that does not fit"));
    assert!(why(|m| m.models[0].number = 10_000).contains("model number 10000"));
    assert!(why(|m| m.atoms[0].radius = Some(1e7)).contains("which does not fit 6 columns"));
}

#[test]
fn figures_lose_decimals_before_they_lose_digits() {
    let mut wide = molecule(&with(7, "    1"));
    wide.atoms[0].b_factor = 12345.678;
    wide.atoms[0].position[0] = 1.0 / 3.0;
    assert_eq!(rounded(&wide), [1, 0]);
    let (back, _) = read_bytes(&written(&wide)).expect("a molecule");
    assert_eq!(
        (back.atoms[0].b_factor, back.atoms[0].position[0]),
        (12346.0, 0.333)
    );
}

#[test]
fn names_stand_where_their_elements_end() {
    let calcium = molecule(&with(13, "CA  ").replace("          C  ", "         CA  "));
    let text = String::from_utf8(written(&calcium)).expect("text");
    assert_eq!(&text[12..16], "CA  ");
    let carbon = String::from_utf8(written(&molecule(&with(13, "CA  ")))).expect("text");
    assert_eq!(&carbon[12..16], " CA ");
}

proptest! {
    #[test]
    fn what_was_written_reads_back(molecule in roundtrip::molecule()) {
        prop_assert_eq!(refusal(&molecule), None);
        let (back, _) = read_bytes(&written(&molecule)).expect("a molecule");
        prop_assert_eq!(back, molecule);
    }

    #[test]
    fn no_text_makes_it_panic(text in "((ATOM  |HETATM|MODEL |MODRES|HEADER|END)[ -~\t]{0,80}\n){0,6}") {
        let _ = read_bytes(text.as_bytes());
    }
}

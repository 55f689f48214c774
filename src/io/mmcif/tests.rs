use super::*;
use crate::io::roundtrip;
use crate::protein::{Atom, Element, Name};
use proptest::prelude::*;

fn read_text(text: &str) -> Result<(Molecule, Vec<Warning>), Fault> {
    let source = Source::from_bytes("test.cif", text.into()).expect("bytes");
    let mut warnings = Vec::new();
    let molecule = read(&source, &mut warnings).map_err(Refusal::fault)?;
    molecule.check()?;
    Ok((molecule, warnings))
}

fn molecule(text: &str) -> Molecule {
    read_text(text).expect("a molecule").0
}

fn message(text: &str) -> String {
    read_text(text).expect_err("a fault").to_string()
}

/// A block with a table of these columns and rows.
fn table(columns: &str, rows: &str) -> String {
    let columns: String = columns
        .split_whitespace()
        .map(|column| format!("_atom_site.{column}\n"))
        .collect();
    format!("data_TEST\nloop_\n{columns}{rows}\n")
}

#[test]
fn columns_stand_in_any_order() {
    let text = table(
        "CARTN_Z Cartn_y Cartn_x occupancy B_iso_or_equiv type_symbol id group_PDB label_atom_id \
         auth_comp_id label_comp_id auth_asym_id auth_seq_id pdbx_PDB_ins_code label_alt_id \
         pdbx_PDB_model_num extra",
        "3 2 1 0.5 17.35 C 7 HETATM \"C1'\" HEM XXX AAA 52 A B 4 'one two'\n\
         6 5 4 . ? FE 8 ATOM FE ? HEM AAA 52 A . 4 ?",
    );
    let found = molecule(&text);
    let expected = Atom {
        position: [1.0, 2.0, 3.0],
        radius: None,
        serial: 7,
        name: Name::new(b"C1'").expect("a name"),
        residue: 0,
        occupancy: 0.5,
        b_factor: 17.35,
        element: Element(6),
        altloc: b'B',
        hetero: true,
    };
    assert_eq!(found.atoms[0], expected);
    let second = found.atoms[1];
    assert_eq!(
        (second.occupancy, second.b_factor, second.altloc),
        (1.0, 0.0, b' ')
    );
    assert_eq!((second.element.symbol(), second.hetero), ("Fe", false));
    assert_eq!(
        (found.residues.len(), found.residues[0].to_string()),
        (1, "AAA:52A".into())
    );
    assert_eq!((&*found.id, found.models[0].number), ("TEST", 4));
}

#[test]
fn what_is_missing_is_told_or_blank() {
    let text = table(
        "Cartn_x Cartn_y Cartn_z label_atom_id label_comp_id label_asym_id label_seq_id",
        "0 0 0 CA CA A .\n1 0 0 CA ALA A 5\n2 0 0 O HOH W .\n3 0 0 O HOH W .",
    );
    let (found, warnings) = read_text(&text).expect("a molecule");
    let symbols: Vec<_> = found
        .atoms
        .iter()
        .map(|atom| atom.element.symbol())
        .collect();
    assert_eq!(symbols, ["Ca", "C", "O", "O"]);
    assert_eq!(&*warnings[0].code, "guessed-elements");
    let serials: Vec<i64> = found.atoms.iter().map(|atom| atom.serial).collect();
    assert_eq!(serials, [1, 2, 3, 4]);
    let residues: Vec<_> = found
        .residues
        .iter()
        .map(|r| (r.number, r.in_polymer))
        .collect();
    assert_eq!(residues, [(0, false), (5, true), (0, false), (0, false)]);
    // Some programs give every atom a place in the sequence.
    let text = table("Cartn_x Cartn_y Cartn_z label_seq_id", "0 0 0 1\n1 0 0 2");
    assert!(
        molecule(&text)
            .residues
            .iter()
            .all(|residue| !residue.in_polymer)
    );
    let listed = text.replace("loop_", "_entity_poly.entity_id 1\nloop_");
    assert!(
        molecule(&listed)
            .residues
            .iter()
            .all(|residue| residue.in_polymer)
    );
}

#[test]
fn a_single_atom_needs_no_loop() {
    let text = "data_\n_cell.length_a 5\n_atom_site.Cartn_x 1\n_atom_site.Cartn_y 2\n\
                _atom_site.type_symbol ZN\n_atom_site.Cartn_z 3";
    let found = molecule(text);
    assert_eq!(
        (found.atoms[0].position, found.atoms.len()),
        ([1.0, 2.0, 3.0], 1)
    );
    assert_eq!(found.atoms[0].element.symbol(), "Zn");
}

#[test]
fn the_first_block_with_atoms_is_read() {
    let atoms = table("Cartn_x Cartn_y Cartn_z", "1 2 3");
    let text = format!("data_empty\nloop_\n_a.b\n_a.c\n1 2 3 4\nsave_x\n{atoms}{atoms}");
    let (found, warnings) = read_text(&text).expect("a molecule");
    assert_eq!((&*found.id, found.atoms.len()), ("TEST", 1));
    assert_eq!(
        (&*warnings[0].code, warnings[0].count),
        ("further-atoms", 1)
    );
}

#[test]
fn models_follow_one_another() {
    let columns = "Cartn_x Cartn_y Cartn_z pdbx_PDB_model_num";
    let found = molecule(&table(columns, "0 0 0 2 1 0 0 2 2 0 0 7"));
    let models: Vec<_> = found
        .models
        .iter()
        .map(|m| (m.number, m.atoms.clone()))
        .collect();
    assert_eq!(models, [(2, 0..2), (7, 2..3)]);
    assert_eq!(
        message(&table(columns, "0 0 0 2\n1 0 0 7\n2 0 0 2")),
        "9: model 2 goes on after model 7"
    );
}

#[test]
fn faults_name_the_line() {
    let columns = "id Cartn_x Cartn_y Cartn_z";
    let row = |row: &str| message(&table(columns, &format!("1 0 0 0\n{row}")));
    assert_eq!(
        row("2 0 0"),
        "8: the atom that begins here lacks 1 value of 4"
    );
    assert_eq!(row("2"), "8: the atom that begins here lacks 3 values of 4");
    assert_eq!(row("2 0\nx 0"), "8: \"x\" is not a number");
    assert_eq!(row("2 0 nan 0"), "8: \"nan\" is not finite");
    assert_eq!(row("2 0 1e999 0"), "8: \"1e999\" is not finite");
    assert_eq!(row("2 0 ? 0"), "8: the atom has no Cartn_y");
    assert_eq!(row("2.5 0 0 0"), "8: the id \"2.5\" is no whole number");
    assert_eq!(
        row("2 0 0 'a\n"),
        "8: the quote \"'a\" does not end on its line"
    );
    let other = |column: &str, value: &str| {
        message(&table(
            &format!("Cartn_x Cartn_y Cartn_z {column}"),
            &format!("0 0 0 {value}"),
        ))
    };
    assert_eq!(
        other("auth_seq_id", "1x"),
        "7: the residue number \"1x\" is no whole number of 32 bits"
    );
    assert_eq!(
        other("label_alt_id", "AB"),
        "7: the alternative \"AB\" is no single character"
    );
    assert_eq!(
        other("occupancy", "1e99"),
        "7: the occupancy \"1e99\" is not finite"
    );
    assert_eq!(
        other("auth_asym_id", "abcdefghijklmnop"),
        "7: the chain \"abcdefghijklmnop\" is longer than 15 characters, or not all of it is printable ASCII"
    );
    assert_eq!(
        message(&table("Cartn_x Cartn_z", "0 0")),
        "2: the atoms that begin here have no column Cartn_y"
    );
    assert_eq!(message("data_x\nloop_\n_a.b\n1\n"), "holds no atoms");
    assert_eq!(
        message("data_x\nloop_\n_atom_site_label\n_atom_site_fract_x\nC1 0.5\n"),
        "holds no atoms of a macromolecule, but those of a crystal's cell"
    );
}

#[test]
fn radii_and_digits_are_written() {
    let mut found = molecule(&table("Cartn_x Cartn_y Cartn_z", "0.1 1e-9 -12345.678901"));
    found.atoms[0].radius = Some(1.85);
    let mut bytes = Vec::new();
    write(&found, &mut bytes).expect("bytes");
    let back = molecule(&String::from_utf8(bytes).expect("text"));
    assert_eq!(back.atoms[0].position, [0.1, 1e-9, -12345.678901]);
    assert_eq!(back.atoms[0].b_factor, 1.85);
}

proptest! {
    #[test]
    fn what_was_written_reads_back(molecule in roundtrip::molecule()) {
        let mut bytes = Vec::new();
        write(&molecule, &mut bytes).expect("bytes");
        let (mut back, _) = read_text(&String::from_utf8(bytes).expect("text")).expect("a molecule");
        if molecule.residues.iter().all(|residue| residue.in_polymer) {
            // Then nothing shows that the places in the sequence are to be trusted.
            back.residues.iter_mut().for_each(|residue| residue.in_polymer = true);
        }
        prop_assert_eq!(back, molecule);
    }

    #[test]
    fn no_text_makes_it_panic(text in "(data_|loop_|_atom_site\\.(Cartn_[xyz]|id)|[0-9.]{1,3}|[ \n;'\"#?]){0,60}") {
        let _ = read_text(&text);
    }
}

//! Telling formats apart.

use super::format::Format;
use crate::error::Fault;

/// Tells the format by the first bytes, and by the extension where they do not tell.
///
/// JSON that its extension does not name is glTF where it has the member `asset` of one, and GeoJSON
/// where its member `type` is of that. Errors
/// when neither tells. Cost: linear in the bytes for such JSON, else constant.
pub fn sniff(bytes: &[u8], extension: Option<&str>) -> Result<Format, Fault> {
    let by_name = extension.and_then(Format::from_extension);
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Ok(super::splats::kind_of(bytes).unwrap_or(Format::Ply));
    }
    if bytes.starts_with(b"glTF") {
        return Ok(Format::Glb);
    }
    if bytes.starts_with(b"NRRD000") {
        return Ok(Format::Nrrd);
    }
    if bytes.starts_with(b"\x93NUMPY") {
        return Ok(Format::Npy);
    }
    if bytes.starts_with(b"#binvox") {
        return Ok(Format::Binvox);
    }
    if let Some(is_packed) = super::las::is_packed(bytes) {
        return Ok(if is_packed { Format::Laz } else { Format::Las });
    }
    if super::geotiff::is_header(bytes) {
        return Ok(Format::GeoTiff);
    }
    if super::shapefile::is_header(bytes) {
        return Ok(Format::Shapefile);
    }
    if super::pcd::is_document(bytes) {
        return Ok(Format::Pcd);
    }
    if bytes.starts_with(super::svo::MAGIC) {
        return Ok(Format::Svo);
    }
    if bytes.starts_with(super::png::MAGIC) {
        return Ok(Format::Png);
    }
    if bytes.starts_with(super::vdb::MAGIC) {
        return Ok(Format::Vdb);
    }
    if bytes.starts_with(super::pc2::MAGIC) {
        return Ok(Format::Pc2);
    }
    if crate::anim::compress::is_stream(bytes) {
        return Ok(Format::Sanim);
    }
    if super::nifti::is_header(bytes) {
        return Ok(Format::Nifti);
    }
    if by_name == Some(Format::Mdd) {
        // Its length may by chance be that of a binary STL.
        return Ok(Format::Mdd);
    }
    if by_name == Some(Format::Stl) || super::stl::is_binary(bytes) {
        return Ok(Format::Stl);
    }
    if by_name == Some(Format::SpheresCsv) && super::wkt_csv::is_document(bytes) {
        return Ok(Format::WktCsv);
    }
    if by_name == Some(Format::SpheresCsv) && super::xyz::is_document(bytes) {
        return Ok(Format::PointsCsv);
    }
    if by_name == Some(Format::Json) && super::geojson::is_document(super::json::unmarked(bytes)) {
        return Ok(Format::GeoJson);
    }
    // Where a name such as `.asc` or `.txt` tells one of points.
    if by_name.is_none_or(|format| format == Format::Xyz) && super::ascii_grid::is_document(bytes) {
        return Ok(Format::AsciiGrid);
    }
    // Names such as `.txt` tell little: whatever text is known goes before them.
    if let Some(format) = by_name.filter(|format| *format != Format::Xyz) {
        return Ok(format);
    }
    if super::mdd::is_exact(bytes) {
        return Ok(Format::Mdd);
    }
    let text = bytes.trim_ascii_start();
    if text.starts_with(b"solid") {
        return Ok(Format::Stl);
    }
    if super::off::has_keyword(text) {
        return Ok(Format::Off);
    }
    let text = super::json::unmarked(text);
    if super::vti::is_document(text) {
        return Ok(Format::Vti);
    }
    if super::gpx::is_document(text) {
        return Ok(Format::Gpx);
    }
    if text.starts_with(b"{") || text.starts_with(b"[") {
        if super::gltf::is_document(text) {
            return Ok(Format::Gltf);
        }
        let is_map = super::geojson::is_document(text);
        return Ok(if is_map {
            Format::GeoJson
        } else {
            Format::Json
        });
    }
    if super::mmcif::is_document(text) {
        return Ok(Format::Cif);
    }
    if super::pdb::is_document(text) {
        let is_pqr = super::pqr::is_document(text);
        return Ok(if is_pqr { Format::Pqr } else { Format::Pdb });
    }
    if super::wkt_csv::is_document(text) {
        return Ok(Format::WktCsv);
    }
    if super::xyzr::is_document(text) {
        return Ok(Format::SpheresCsv);
    }
    if by_name == Some(Format::Xyz) || super::xyz::is_document(text) {
        return Ok(Format::Xyz);
    }
    let names: Vec<_> = Format::all()
        .filter(|f| f.is_read())
        .map(Format::name)
        .collect();
    Err(
        Fault::whole("neither its first bytes nor its name tell the format").with_hint(format!(
            "name it with --input-format, one of: {}",
            names.join(", ")
        )),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_told_from_gltf_by_its_name_and_else_by_what_it_holds() {
        let gltf = br#"{"asset": {"version": "2.0"}}"#.as_slice();
        let report = br#" {"schema": 1, "scantle": "0.1.0"}"#.as_slice();
        let marked = b"\xef\xbb\xbf{}".as_slice();
        for (bytes, extension, format) in [
            (gltf, None, Format::Gltf),
            (gltf, Some("txt"), Format::Gltf),
            (gltf, Some("gltf"), Format::Gltf),
            (gltf, Some("JSON"), Format::Json),
            (report, None, Format::Json),
            (report, Some("log"), Format::Json),
            (report, Some("jsonl"), Format::Json),
            (report, Some("gltf"), Format::Gltf),
            (b"[1, 2]", None, Format::Json),
            (b"12", Some("json"), Format::Json),
            (marked, None, Format::Json),
            (b"ply\n", Some("json"), Format::Ply),
        ] {
            assert_eq!(sniff(bytes, extension), Ok(format), "{extension:?}");
        }
        assert!(sniff(b"12", None).is_err());
    }

    #[test]
    fn caches_of_points_are_told_by_magic_or_by_size() {
        let pc2 = b"POINTCACHE2\0\x01\0\0\0".as_slice();
        assert_eq!(sniff(pc2, Some("bin")), Ok(Format::Pc2));
        let mut mdd = vec![0; 8 + 4 + 12];
        mdd[3] = 1;
        mdd[7] = 1;
        assert_eq!(sniff(&mdd, None), Ok(Format::Mdd));
        assert_eq!(sniff(&mdd[..20], Some("mdd")), Ok(Format::Mdd));
        assert!(sniff(&mdd[..20], None).is_err());
    }

    #[test]
    fn nifti_and_vti_are_told_by_their_first_bytes() {
        let mut nifti = vec![0; 348];
        nifti[..2].copy_from_slice(&348u16.to_le_bytes());
        nifti[344..].copy_from_slice(b"n+1\0");
        let vti = b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<!-- a -->\n<VTKFile type=\"ImageData\">";
        for extension in [None, Some("img"), Some("obj")] {
            assert_eq!(sniff(&nifti, extension), Ok(Format::Nifti), "{extension:?}");
        }
        assert_eq!(sniff(vti, None), Ok(Format::Vti));
        assert_eq!(sniff(&vti[3..], Some("xml")), Ok(Format::Vti));
        // Without its magic it is whatever its name says.
        nifti[344] = 0;
        assert_eq!(sniff(&nifti, Some("nii")), Ok(Format::Nifti));
        assert!(sniff(&nifti, None).is_err());
        assert!(sniff(b"<svg>", None).is_err());
    }
}

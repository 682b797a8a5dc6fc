//! The Content-Security-Policy of a page: its own scripts run, by their hashes, and it loads and sends nothing. Should
//! a text of a case ever become markup, no script of it runs.
//!
//! W3C, *Content Security Policy Level 3*: a hash is that of the text of a script element, SHA-256 in base64.

use sha2::{Digest, Sha256};

/// The hash of plotly.js as `page.js` unpacks it: `base64 -d FILE | gunzip | openssl dgst -sha256 -binary | base64`.
const PLOTLY_HASH: &str = "J8UgPsugUt5kR2A2lvOVWPXRlhg5unqxU2OfZtPQ1Wk=";

/// The element of the head that allows these scripts, as they are between their tags, and plotly.js. Styles are not
/// restricted: plotly.js sets them.
pub(super) fn element(scripts: &[&str]) -> String {
    let hashes =
        scripts.iter().map(|script| base64(&Sha256::digest(script.as_bytes()))).chain([PLOTLY_HASH.to_owned()]);
    let allowed: String = hashes.map(|hash| format!(" 'sha256-{hash}'")).collect();
    format!(
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src{allowed}; style-src \
         'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'\">\n"
    )
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |group: &[u8]| -> [char; 4] {
        let bits = (0..3).fold(0, |bits, at| bits << 8 | u32::from(group.get(at).copied().unwrap_or(0)));
        std::array::from_fn(|at| match at <= group.len() {
            true => char::from(LETTERS[(bits >> (18 - 6 * at) & 63) as usize]),
            false => '=',
        })
    };
    bytes.chunks(3).flat_map(group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_has_the_test_vectors_of_rfc_4648() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn a_page_allows_its_own_scripts_and_no_other_source() {
        let element = element(&["alert('Hello, world.');"]);
        // The example of the specification, section 8.4 of Level 2.
        assert!(element.contains("'sha256-qznLcsROx4GACP2dm0UCKCzCG+HiZ1guq6ZZDob/Tng='"), "{element}");
        assert!(!element.contains("http:") && !element.contains("script-src 'unsafe"), "{element}");
    }
}

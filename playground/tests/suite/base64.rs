//! Bytes as text.

use straightline_core::random::Random;
use straightline_playground::base64::{decoded, encoded, numbers, of_numbers};

#[test]
fn texts_are_those_of_the_standard_and_come_back() {
    for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(encoded(bytes.as_bytes()), text);
        assert_eq!(decoded(text).as_deref(), Some(bytes.as_bytes()));
    }
    let mut random = Random(3);
    for length in 0..100 {
        let bytes: Vec<u8> = (0..length).map(|_| random.bits() as u8).collect();
        assert_eq!(decoded(&encoded(&bytes)), Some(bytes));
    }
    let some = [0.1, -0.0, 1e300, f64::MIN_POSITIVE];
    assert_eq!(numbers(&of_numbers(&some)).unwrap(), some);
    assert_eq!(decoded("a*b="), None);
    assert_eq!(numbers(&encoded(b"seven b")), None);
}

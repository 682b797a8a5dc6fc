//! The words of a SPIR-V module as a sequence of instructions.

/// Words of the SPIR-V header.
pub const HEADER_WORDS: usize = 5;

/// Opcode and operands of each instruction. In SPIR-V an instruction's first word holds its length in words in the
/// upper half and the opcode in the lower half.
pub fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = &words[HEADER_WORDS..];
    std::iter::from_fn(move || {
        let &first = rest.first()?;
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        Some((first & 0xffff, &instruction[1..]))
    })
}

pub fn push(words: &mut Vec<u32>, code: u32, operands: &[u32]) {
    words.push((operands.len() as u32 + 1) << 16 | code);
    words.extend(operands);
}

// Unpacks LZMA (Igor Pavlov's specification of 2015, the format of `xz --format=lzma`): browsers unpack DEFLATE alone, which takes half as many bytes again.
function unpacked(packed, size) {
  const properties = packed[0];
  const [lc, lp, pb] = [properties % 9, Math.floor(properties / 9) % 5, Math.floor(properties / 45)];
  const out = new Uint8Array(size);
  const fresh = (count) => new Uint16Array(count).fill(1024);
  let [place, code, range, made] = [14, 0, 0xffffffff, 0];
  for (let k = 0; k < 4; k++) code = ((code << 8) | packed[place++]) >>> 0;

  function bit(chances, at) {
    const chance = chances[at];
    const bound = (range >>> 11) * chance;
    let found;
    if (code < bound) {
      range = bound;
      chances[at] = chance + ((2048 - chance) >>> 5);
      found = 0;
    } else {
      range -= bound;
      code -= bound;
      chances[at] = chance - (chance >>> 5);
      found = 1;
    }
    if (range < 0x1000000) {
      range = (range << 8) >>> 0;
      code = ((code << 8) | packed[place++]) >>> 0;
    }
    return found;
  }
  // Bits by a tree of chances, the highest first, or the lowest.
  function tree(chances, from, count) {
    let at = 1;
    for (let k = 0; k < count; k++) at = (at << 1) | bit(chances, from + at);
    return at - (1 << count);
  }
  function reversed(chances, from, count) {
    let [at, found] = [1, 0];
    for (let k = 0; k < count; k++) {
      const next = bit(chances, from + at);
      at = (at << 1) | next;
      found |= next << k;
    }
    return found;
  }
  function plain(count) {
    let found = 0;
    for (let k = 0; k < count; k++) {
      range >>>= 1;
      const next = code >= range ? 1 : 0;
      if (next) code -= range;
      found = found * 2 + next;
      if (range < 0x1000000) {
        range = (range << 8) >>> 0;
        code = ((code << 8) | packed[place++]) >>> 0;
      }
    }
    return found;
  }
  const lengths = () => ({ choice: fresh(2), low: fresh(128), middle: fresh(128), high: fresh(256) });
  function length({ choice, low, middle, high }, position) {
    if (!bit(choice, 0)) return tree(low, position << 3, 3);
    if (!bit(choice, 1)) return 8 + tree(middle, position << 3, 3);
    return 16 + tree(high, 0, 8);
  }

  const literals = fresh(0x300 << (lc + lp));
  const [isMatch, isLong] = [fresh(192), fresh(192)];
  const [isAgain, isSecond, isThird, isFourth] = [fresh(12), fresh(12), fresh(12), fresh(12)];
  const [slots, special, aligned] = [fresh(256), fresh(128), fresh(16)];
  const [matches, repeats] = [lengths(), lengths()];
  let state = 0;
  let back = [0, 0, 0, 0];
  while (made < size) {
    const position = made & ((1 << pb) - 1);
    if (!bit(isMatch, (state << 4) + position)) {
      const before = made ? out[made - 1] : 0;
      const from = 0x300 * (((made & ((1 << lp) - 1)) << lc) + (before >> (8 - lc)));
      let symbol = 1;
      if (state >= 7) {
        let other = out[made - back[0] - 1];
        while (symbol < 0x100) {
          const expected = (other >> 7) & 1;
          other <<= 1;
          const next = bit(literals, from + ((1 + expected) << 8) + symbol);
          symbol = (symbol << 1) | next;
          if (expected !== next) break;
        }
      }
      while (symbol < 0x100) symbol = (symbol << 1) | bit(literals, from + symbol);
      out[made++] = symbol;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let count;
    if (bit(isAgain, state)) {
      if (!bit(isSecond, state)) {
        if (!bit(isLong, (state << 4) + position)) {
          state = state < 7 ? 9 : 11;
          out[made] = out[made - back[0] - 1];
          made++;
          continue;
        }
      } else {
        const which = !bit(isThird, state) ? 1 : !bit(isFourth, state) ? 2 : 3;
        back = [back[which], ...back.filter((_, k) => k !== which)];
      }
      count = length(repeats, position);
      state = state < 7 ? 8 : 11;
    } else {
      count = length(matches, position);
      state = state < 7 ? 7 : 10;
      const slot = tree(slots, Math.min(count, 3) << 6, 6);
      let distance = slot;
      if (slot >= 4) {
        const bits = (slot >> 1) - 1;
        distance = (2 | (slot & 1)) * 2 ** bits;
        if (slot < 14) distance += reversed(special, distance - slot, bits);
        else distance += plain(bits - 4) * 16 + reversed(aligned, 0, 4);
      }
      if (distance === 0xffffffff) break;
      back = [distance, back[0], back[1], back[2]];
    }
    const from = made - back[0] - 1;
    if (from < 0) throw new Error("the packed compiler is damaged");
    const end = Math.min(size, made + count + 2);
    for (let k = from; made < end; k++) out[made++] = out[k];
  }
  if (made !== size) throw new Error("the packed compiler is damaged");
  return out;
}

// Tables in textures: number k of a table, in rows of 1024.
ivec2 cell(int k) {
    return ivec2(k & 1023, k >> 10);
}

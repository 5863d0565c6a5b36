#version 330
flat in int owner;
out int seen;

void main() { seen = owner + 1; }  // 0 is nothing

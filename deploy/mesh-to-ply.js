// mesh-to-ply.js MODULE OUT.ply: the vertices of a mesh module ({positions: [[x, y, z], ...]}) as a binary PLY cloud.
// Vertices that coincide are kept once.
'use strict'
const fs = require('fs')
const path = require('path')

const [module_, out] = process.argv.slice(2)
if (!out) {
  console.error('usage: mesh-to-ply.js MODULE OUT.ply')
  process.exit(2)
}
const mesh = require(path.resolve(module_))
if (!mesh || !Array.isArray(mesh.positions) || mesh.positions.length === 0) {
  console.error(`mesh-to-ply.js: ${module_}: no positions in the module`)
  process.exit(1)
}
const seen = new Set()
const points = mesh.positions.filter(p => !seen.has(p.join()) && seen.add(p.join()))
const header = 'ply\nformat binary_little_endian 1.0\n' +
  `element vertex ${points.length}\nproperty float x\nproperty float y\nproperty float z\nend_header\n`
const body = Buffer.alloc(12 * points.length)
points.forEach((p, i) => p.forEach((value, j) => body.writeFloatLE(value, 12 * i + 4 * j)))
fs.writeFileSync(out, Buffer.concat([Buffer.from(header), body]))
console.log(`${path.basename(module_)}: ${mesh.positions.length} vertices, ${points.length} different`)

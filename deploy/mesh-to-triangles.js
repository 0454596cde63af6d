// mesh-to-triangles.js MESH OUT.ply: the vertices and triangles of a mesh as a binary PLY file of one form, which
// gnp-validate reads. MESH is a file (.off, .stl, .ply, .obj as MNI writes brains; .gz of them) or a folder that holds
// a module {positions, cells}. Vertices that coincide become one, polygons fans of triangles; triangles without an
// area and vertices of no triangle are left out.
'use strict'
const fs = require('fs')
const path = require('path')
const zlib = require('zlib')

const [source, out] = process.argv.slice(2)
if (!out) {
  console.error('usage: mesh-to-triangles.js MESH OUT.ply')
  process.exit(2)
}

function words(text) {
  return text.replace(/#.*/g, '').split(/\s+/).filter(word => word)
}

function readOff(bytes) {
  const all = words(bytes.toString('latin1'))
  let at = /OFF$/.test(all[0]) ? 1 : 0
  const colours = /^C/.test(all[0]) ? 4 : 0
  const [vertices, faces] = [Number(all[at]), Number(all[at + 1])]
  at += 3
  const positions = [], cells = []
  for (let i = 0; i < vertices; i++, at += 3 + colours)
    positions.push([Number(all[at]), Number(all[at + 1]), Number(all[at + 2])])
  const lines = bytes.toString('latin1').replace(/#.*/g, '').split('\n').filter(line => line.trim())
  for (const line of lines.slice(lines.length - faces)) { // a face's line may end with a colour
    const [corners, ...rest] = words(line).map(Number)
    cells.push(rest.slice(0, corners))
  }
  return {positions, cells}
}

function readStl(bytes) {
  const positions = [], cells = []
  const count = bytes.length >= 84 ? bytes.readUInt32LE(80) : 0
  if (bytes.length === 84 + 50 * count) {
    for (let i = 0; i < count; i++)
      for (let corner = 0; corner < 3; corner++)
        positions.push([0, 4, 8].map(axis => bytes.readFloatLE(84 + 50 * i + 12 + 12 * corner + axis)))
  } else {
    for (const match of bytes.toString('latin1').matchAll(/vertex\s+(\S+)\s+(\S+)\s+(\S+)/g))
      positions.push(match.slice(1).map(Number))
  }
  for (let i = 0; i < positions.length; i += 3)
    cells.push([i, i + 1, i + 2])
  return {positions, cells}
}

const bytesOf = {
  char: 1, uchar: 1, int8: 1, uint8: 1, short: 2, ushort: 2, int: 4, uint: 4, int32: 4, uint32: 4, float: 4, float32: 4,
  double: 8
}

function readPly(bytes) {
  const length = bytes.indexOf('end_header') + 'end_header'.length
  const elements = []
  let format
  for (const line of bytes.toString('latin1', 0, length).split(/\r?\n/)) {
    const [key, ...rest] = line.trim().split(/\s+/)
    if (key === 'format') format = rest[0]
    if (key === 'element') elements.push({name: rest[0], count: Number(rest[1]), properties: []})
    if (key === 'property') elements[elements.length - 1].properties.push(rest)
  }
  const ascii = format === 'ascii' && words(bytes.toString('latin1', length))
  const end = format === 'binary_big_endian' ? 'BE' : 'LE'
  let at = ascii ? 0 : bytes.indexOf('\n', length) + 1
  function value(type) {
    if (ascii) return Number(ascii[at++])
    const size = bytesOf[type], unsigned = type[0] === 'u' ? 'U' : '', from = at
    at += size
    if (/float|double/.test(type))
      return size === 8 ? bytes['readDouble' + end](from) : bytes['readFloat' + end](from)
    return size === 1 ? bytes[`read${unsigned}Int8`](from) : bytes[`read${unsigned}Int${8 * size}${end}`](from)
  }
  const mesh = {positions: [], cells: []}
  for (const element of elements)
    for (let i = 0; i < element.count; i++) {
      const row = {}
      for (const property of element.properties)
        row[property[property.length - 1]] = property[0] === 'list'
          ? Array.from({length: value(property[1])}, () => value(property[2])) : value(property[0])
      if (element.name === 'vertex') mesh.positions.push([row.x, row.y, row.z])
      if (element.name === 'face') mesh.cells.push(row.vertex_indices || row.vertex_index)
    }
  return mesh
}

// P and five numbers, the count of points, points, normals, the count of polygons, colours, where each polygon ends,
// corners.
function readMni(bytes) {
  const all = words(bytes.toString('latin1'))
  const points = Number(all[6]), positions = [], cells = []
  for (let i = 0; i < points; i++)
    positions.push([7, 8, 9].map(axis => Number(all[axis + 3 * i])))
  let at = 7 + 6 * points
  const polygons = Number(all[at])
  at += 2 + 4 * (all[at + 1] === '0' ? 1 : all[at + 1] === '1' ? polygons : points)
  for (let i = 0, from = 0; i < polygons; i++) {
    const to = Number(all[at + i])
    cells.push(all.slice(at + polygons + from, at + polygons + to).map(Number))
    from = to
  }
  return {positions, cells}
}

function readModule(folder) {
  const mesh = require(path.resolve(folder))
  const rows = array => typeof array[0] === 'number'
    ? Array.from({length: array.length / 3}, (_, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]]) : array
  return {positions: rows(mesh.positions), cells: rows(mesh.cells)}
}

function read(file) {
  if (fs.statSync(file).isDirectory()) return readModule(file)
  const name = file.replace(/\.gz$/, '')
  const bytes = file === name ? fs.readFileSync(file) : zlib.gunzipSync(fs.readFileSync(file))
  const reader = {'.off': readOff, '.stl': readStl, '.ply': readPly, '.obj': readMni}[path.extname(name)]
  if (!reader) throw new Error('need .off, .stl, .ply, .obj or a folder')
  return reader(bytes)
}

function area(a, b, c) {
  const u = b.map((x, i) => x - a[i]), v = c.map((x, i) => x - a[i])
  return Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
}

function triangulate({positions, cells}) {
  const places = new Map(), float = positions.map(point => Array.from(Float32Array.from(point)))
  const first = float.map((point, i) => {
    const key = point.join()
    if (!places.has(key)) places.set(key, i)
    return places.get(key)
  })
  const used = new Map(), points = [], triangles = []
  const number = i => {
    if (!used.has(i)) used.set(i, points.push(float[i]) - 1)
    return used.get(i)
  }
  for (const cell of cells)
    for (let i = 2; i < cell.length; i++) {
      const [a, b, c] = [cell[0], cell[i - 1], cell[i]].map(corner => first[corner])
      if (area(float[a], float[b], float[c]) > 0) triangles.push([a, b, c].map(number))
    }
  return {points, triangles}
}

function boundaryEdges(triangles) {
  const edges = new Map()
  for (const t of triangles)
    for (let i = 0; i < 3; i++) {
      const [a, b] = [t[i], t[(i + 1) % 3]]
      const key = Math.min(a, b) * 2 ** 26 + Math.max(a, b)
      edges.set(key, (edges.get(key) || 0) + 1)
    }
  return [...edges.values()].filter(count => count === 1).length
}

const {points, triangles} = triangulate(read(source))
const header = Buffer.from('ply\nformat binary_little_endian 1.0\n' +
  `element vertex ${points.length}\nproperty float x\nproperty float y\nproperty float z\n` +
  `element face ${triangles.length}\nproperty list uchar int vertex_indices\nend_header\n`)
const body = Buffer.alloc(12 * points.length + 13 * triangles.length)
points.forEach((point, i) => point.forEach((x, axis) => body.writeFloatLE(x, 12 * i + 4 * axis)))
triangles.forEach((corners, i) => {
  const at = 12 * points.length + 13 * i
  body[at] = 3
  corners.forEach((corner, j) => body.writeInt32LE(corner, at + 1 + 4 * j))
})
fs.writeFileSync(out, Buffer.concat([header, body]))
console.log(`${path.basename(out, '.ply')}: ${points.length} vertices, ${triangles.length} triangles, ` +
  `${boundaryEdges(triangles)} open edges`)

/* The codec of files: a file of points comes in, one with the answer goes out.
 *
 * The input's format: Content-Type, else the body's first bytes, else ?format=. The output's: Accept, else ?format=,
 * else the input's where it can be written, else PLY; one that nobody asked for gives way to NPZ where it has no
 * place for the answer. An Accept asks for its format where it names the type, and where its range does not cover
 * NPZ, which could then not take that format's place. All other query parameters are the operation's. */
#ifndef GNPD_CODEC_FILE_H
#define GNPD_CODEC_FILE_H

#include "server/work/codec.h"

extern const struct gnpd_codec gnpd_codec_file;

#endif

/* The codec of the Open Inference Protocol: JSON, with tensors as numbers in it or as bytes behind it. */
#ifndef GNPD_CODEC_OIP_H
#define GNPD_CODEC_OIP_H

#include "server/work/codec.h"

extern const struct gnpd_codec gnpd_codec_oip;

#endif

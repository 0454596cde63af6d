/* The version of all that is built here: the library, gnpd and gnp. Nothing else defines one. */
#ifndef GNP_VERSION_H
#define GNP_VERSION_H

#define GNP_VERSION "0.1.0"
#define GNP_VERSION_MAJOR 0
#define GNP_VERSION_MINOR 1
#define GNP_VERSION_PATCH 0

#endif

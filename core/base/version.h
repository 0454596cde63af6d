/* The version of everything in this tree: the library, the daemon and the command line have one (semantic versioning
 * 2.0). */
#ifndef GNP_CORE_VERSION_H
#define GNP_CORE_VERSION_H

#define GNP_VERSION_MAJOR 0
#define GNP_VERSION_MINOR 1
#define GNP_VERSION_PATCH 0
#define GNP_VERSION "0.1.0"

#endif

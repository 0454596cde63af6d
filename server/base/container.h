/* Finds the struct that holds a member: for callbacks that are given what is embedded in what they are about. */
#ifndef GNPD_CONTAINER_H
#define GNPD_CONTAINER_H

#include <stddef.h>

#define GNPD_CONTAINER_OF(pointer, type, member) ((type *)(void *)((char *)(pointer) - offsetof(type, member)))

#endif

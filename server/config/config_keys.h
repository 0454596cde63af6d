/* The table of keys: what each is called, of what kind, its default, range and help. What is asked of all keys alike
 * (set, print, list, help; config.h) is answered from it. */
#ifndef GNPD_CONFIG_KEYS_H
#define GNPD_CONFIG_KEYS_H

#include <stdbool.h>

#include "server/config/config.h"

enum { GNPD_CONFIG_KEYS_MAX = 128 };

/* Its index in the table, by its old name too, 0..GNPD_CONFIG_KEYS_MAX - 1; -1 when there is no such key. */
int gnpd_config_key_find(const char *key);
/* Is it true or false? */
bool gnpd_config_key_is_flag(int index);

#endif

#include "weights/train/loss_rule.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MORE = 4, NAMES = GNP_LOSS_TERMS + MORE };

static const char *name_at(int i)
{
	static const char *const more[MORE] = {"floor", "focus", "most", "power"};
	return i < GNP_LOSS_TERMS ? gnp_loss_name((enum gnp_loss_term)i) : more[i - GNP_LOSS_TERMS];
}

static double *value_at(struct gnp_loss_rule *rule, int i)
{
	double *const more[MORE] = {&rule->floor, &rule->focus, &rule->most, &rule->power};
	return i < GNP_LOSS_TERMS ? &rule->lambda[i] : more[i - GNP_LOSS_TERMS];
}

static int find_name(const char *word, size_t length)
{
	for (int i = 0; i < NAMES; i++)
		if (strlen(name_at(i)) == length && memcmp(name_at(i), word, length) == 0)
			return i;
	return -1;
}

gnp_status gnp_loss_rule_parse(const char *text, const char *what, struct gnp_loss_rule *rule, struct gnp_error *error)
{
	struct gnp_loss_rule parsed = *rule;
	for (const char *word = text; word;) {
		size_t length = strcspn(word, ","), name = strcspn(word, "=,");
		char *end = NULL;
		int found = find_name(word, name);
		double value = word[name] == '=' ? strtod(word + name + 1, &end) : NAN;
		if (found < 0 || !end || end != word + length || end == word + name + 1 || !(value >= 0 && value <= 1e6))
			return gnp_error_set(
				error, GNP_INVALID_ARGUMENT,
				"%s: got '%.*s', need NAME=NUMBER with a number of 0..1e6 and a name of height, normal, "
				"inverse_metric, second_form, gaussian_curvature, mean_curvature, angle, floor, focus, most, power",
				what, (int)length, word);
		*value_at(&parsed, found) = value;
		word = word[length] ? word + length + 1 : NULL;
	}
	if (!(parsed.most > 0))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got most=0, need more", what);
	*rule = parsed;
	return GNP_OK;
}

void gnp_loss_rule_print(const struct gnp_loss_rule *rule, char *text, size_t size)
{
	struct gnp_loss_rule copy = *rule; /* value_at points into what is not const */
	size_t used = 0;
	text[0] = 0;
	for (int i = 0; i < NAMES && used < size; i++)
		if (*value_at(&copy, i) > 0 && !isinf(*value_at(&copy, i)))
			used += (size_t)snprintf(text + used, size - used, "%s%s=%g", used ? "," : "", name_at(i), *value_at(&copy, i));
}

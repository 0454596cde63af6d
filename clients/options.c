#include "clients/options.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/names.h"

static const struct gnp_option *find_long(const struct gnp_option *options, size_t count, const char *name, size_t length)
{
	for (size_t i = 0; i < count; i++)
		if (strlen(options[i].name) == length && memcmp(options[i].name, name, length) == 0)
			return &options[i];
	return NULL;
}

static const struct gnp_option *find_letter(const struct gnp_option *options, size_t count, char letter)
{
	for (size_t i = 0; i < count; i++)
		if (options[i].letter && options[i].letter == letter)
			return &options[i];
	return NULL;
}

static gnp_status record(struct gnp_arguments *arguments, const struct gnp_option *option, const char *value,
                         struct gnp_error *error)
{
	if (gnp_arguments_has(arguments, option->name))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: given twice", option->name);
	if (arguments->option_count == GNP_OPTIONS_GIVEN_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "options: got more than %d", GNP_OPTIONS_GIVEN_MAX);
	arguments->options[arguments->option_count++] = (struct gnp_option_given){option, value};
	return GNP_OK;
}

static gnp_status unknown_option(const char *text, const struct gnp_option *options, size_t count, struct gnp_error *error)
{
	struct gnp_names names;
	const char *name = text + strspn(text, "-");
	gnp_names_begin(&names, name, strcspn(name, "="));
	for (size_t i = 0; i < count; i++)
		gnp_names_add(&names, options[i].name);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.80s: unknown option%s", text, gnp_names_hint(&names));
}

static gnp_status parse_option(int argc, char **argv, int *i, const struct gnp_option *options, size_t option_count,
                               struct gnp_arguments *arguments, struct gnp_error *error)
{
	const char *text = argv[*i], *value = NULL;
	const struct gnp_option *option;
	if (text[1] == '-') {
		size_t length = strcspn(text + 2, "=");
		option = find_long(options, option_count, text + 2, length);
		value = text[2 + length] == '=' ? text + 3 + length : NULL;
	} else {
		option = find_letter(options, option_count, text[1]);
		value = text[2] ? text + 2 : NULL;
	}
	if (!option)
		return unknown_option(text, options, option_count, error);
	if (value && !option->value)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: --%s takes no value", text, option->name);
	if (!value && (!option->value || option->value[0] == '['))
		value = "true";
	if (!value && *i + 1 < argc)
		value = argv[++*i];
	if (!value)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: needs %s", text, option->value);
	return record(arguments, option, value, error);
}

gnp_status gnp_arguments_parse(int argc, char **argv, const struct gnp_option *options, size_t option_count,
                               size_t operands_most, struct gnp_arguments *arguments, struct gnp_error *error)
{
	bool operands_only = false;
	*arguments = (struct gnp_arguments){0};
	for (int i = 0; i < argc; i++) {
		const char *text = argv[i];
		if (!operands_only && strcmp(text, "--") == 0) {
			operands_only = true;
		} else if (!operands_only && text[0] == '-' && text[1]) {
			gnp_status status = parse_option(argc, argv, &i, options, option_count, arguments, error);
			if (status != GNP_OK)
				return status;
		} else if (arguments->operand_count == operands_most || arguments->operand_count == GNP_OPERANDS_MAX) {
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: unexpected, need at most %zu operands", text, operands_most);
		} else {
			arguments->operands[arguments->operand_count++] = text;
		}
	}
	return GNP_OK;
}

const char *gnp_arguments_get(const struct gnp_arguments *arguments, const char *name, const char *otherwise)
{
	for (size_t i = 0; i < arguments->option_count; i++)
		if (strcmp(arguments->options[i].option->name, name) == 0)
			return arguments->options[i].value;
	return otherwise;
}

bool gnp_arguments_has(const struct gnp_arguments *arguments, const char *name)
{
	return gnp_arguments_get(arguments, name, NULL) != NULL;
}

gnp_status gnp_arguments_integer(const struct gnp_arguments *arguments, const char *name, uint64_t minimum,
                                 uint64_t maximum, uint64_t *value, struct gnp_error *error)
{
	const char *text = gnp_arguments_get(arguments, name, NULL);
	if (!text)
		return GNP_OK;
	char *end;
	errno = 0;
	unsigned long long parsed = strtoull(text, &end, 10);
	if (text[0] < '0' || text[0] > '9' || *end || errno || parsed < minimum || parsed > maximum)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: got '%s', need an integer in %llu..%llu", name, text,
		                     (unsigned long long)minimum, (unsigned long long)maximum);
	*value = parsed;
	return GNP_OK;
}

gnp_status gnp_arguments_number(const struct gnp_arguments *arguments, const char *name, double minimum, double maximum,
                                double *value, struct gnp_error *error)
{
	const char *text = gnp_arguments_get(arguments, name, NULL);
	if (!text)
		return GNP_OK;
	char *end;
	double parsed = strtod(text, &end);
	if (end == text || *end || !(parsed >= minimum && parsed <= maximum))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: got '%s', need a number in %g..%g", name, text, minimum, maximum);
	*value = parsed;
	return GNP_OK;
}

gnp_status gnp_arguments_pair(const struct gnp_arguments *arguments, const char *name, double minimum, double maximum,
                              double pair[2], struct gnp_error *error)
{
	const char *text = gnp_arguments_get(arguments, name, NULL);
	if (!text)
		return GNP_OK;
	double parsed[2] = {NAN, NAN};
	char *end;
	parsed[0] = strtod(text, &end);
	bool good = end != text && (*end == ',' || *end == 'x');
	if (good) {
		const char *second = end + 1;
		parsed[1] = strtod(second, &end);
		good = end != second && !*end;
	}
	for (int i = 0; i < 2; i++)
		good = good && parsed[i] >= minimum && parsed[i] <= maximum;
	if (!good)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: got '%s', need two numbers in %g..%g with a comma between",
		                     name, text, minimum, maximum);
	pair[0] = parsed[0];
	pair[1] = parsed[1];
	return GNP_OK;
}

void gnp_options_print(const struct gnp_option *options, size_t count, FILE *out)
{
	for (size_t i = 0; i < count; i++) {
		const struct gnp_option *option = &options[i];
		if (!option->help)
			continue;
		char left[64];
		snprintf(left, sizeof left, "%c%c%s --%s%s%s", option->letter ? '-' : ' ', option->letter ? option->letter : ' ',
		         option->letter ? "," : " ", option->name, option->value ? " " : "", option->value ? option->value : "");
		fprintf(out, "  %-30s %s\n", left, option->help);
	}
}

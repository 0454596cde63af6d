#include "proto/operation/usage.h"

#include "proto/operation/parameter.h"
#include "proto/tensor/writer.h"

static void put_choices(struct gnp_writer *w, const struct gnp_parameter *p)
{
	for (size_t i = 0; p->choices[i]; i++)
		gnp_writer_printf(w, "%s%s", i ? "|" : "", p->choices[i]);
}

/* What follows a flag's name: 12..500, cover|all, NAMES; that of a switch may be left out. */
static void put_value(struct gnp_writer *w, const struct gnp_parameter *p)
{
	char range[GNP_PARAMETER_RANGE_MAX];
	gnp_parameter_range(p, range);
	gnp_writer_text(w, p->type == GNP_PARAMETER_BOOL ? "" : " ");
	switch (p->type) {
	case GNP_PARAMETER_INTEGER:
	case GNP_PARAMETER_NUMBER: gnp_writer_text(w, range); break;
	case GNP_PARAMETER_AUTO: gnp_writer_printf(w, "auto|%s", range); break;
	case GNP_PARAMETER_BOOL: gnp_writer_text(w, "[=true|false]"); break;
	case GNP_PARAMETER_CHOICE: put_choices(w, p); break;
	case GNP_PARAMETER_SET: gnp_writer_text(w, "NAME,..."); break;
	case GNP_PARAMETER_MODEL: gnp_writer_text(w, "auto|NAME"); break;
	}
}

gnp_status gnp_operation_usage(const struct gnp_operation *operation, struct gnp_buffer *buffer,
                               struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(buffer, error);
	char default_text[GNP_PARAMETER_DEFAULT_MAX];
	for (size_t i = 0; i < operation->parameter_count; i++) {
		const struct gnp_parameter *p = &operation->parameters[i];
		gnp_writer_printf(&w, "  --%s", p->name);
		put_value(&w, p);
		gnp_parameter_default(operation, p, default_text);
		gnp_writer_printf(&w, "\n        %s (default %s)\n", p->help, default_text);
		for (size_t o = 0; p->type == GNP_PARAMETER_SET && o < operation->output_count; o++)
			gnp_writer_printf(&w, "          %-28s %s\n", operation->outputs[o].name, operation->outputs[o].help);
	}
	return w.status;
}

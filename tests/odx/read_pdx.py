"""A reader of PDX archives, from ISO 22901-1: resolves every reference, and decodes messages by the services of a layer. It knows of ODX what
diagnostic descriptions of plain ECUs need, and nothing of the program that wrote the archive."""
import struct
import xml.etree.ElementTree as ElementTree
import zipfile

TYPE = "{http://www.w3.org/2001/XMLSchema-instance}type"


class Broken(Exception):
    """Of the archive."""


class Other(Exception):
    """The message is none of this service."""


class Pdx:
    def __init__(self, path):
        with zipfile.ZipFile(path) as archive:
            if archive.testzip() is not None:
                raise Broken("a damaged entry")
            names = set(archive.namelist())
            index = ElementTree.fromstring(archive.read("index.xml"))
            listed = {f.text for f in index.iter("FILE")}
            if names != listed | {"index.xml"}:
                raise Broken(f"the catalogue lists {sorted(listed)}, the archive holds {sorted(names)}")
            roots = {name: ElementTree.fromstring(archive.read(name)) for name in sorted(listed)}
        # An ID holds in its document, which a reference names by the SHORT-NAME of its first element.
        self.documents, self.references = {}, 0
        for name, root in roots.items():
            if root.tag != "ODX" or not root.get("MODEL-VERSION", "").startswith("2.2"):
                raise Broken(f"{name}: no ODX 2.2")
            content = root[0]
            ids = {}
            for element in content.iter():
                if "ID" in element.attrib and ids.setdefault(element.get("ID"), element) is not element:
                    raise Broken(f"{name}: ID {element.get('ID')} twice")
            self.documents[content.findtext("SHORT-NAME")] = (content, ids)
        for content, ids in self.documents.values():
            self._resolve_all(content, ids)
            self._names_are_unique(content)
        layers = [(content, layer) for content, _ in self.documents.values() for layer in content.iter("BASE-VARIANT")]
        if len(layers) != 1:
            raise Broken(f"{len(layers)} layers")
        self.ids = self.documents[layers[0][0].findtext("SHORT-NAME")][1]
        self.layer = layers[0][1]
        self.services = {s.findtext("SHORT-NAME"): s for s in self.layer.iter("DIAG-SERVICE")}

    def _resolve_all(self, content, ids):
        for element in content.iter():
            wanted = element.get("ID-REF")
            if wanted is None:
                continue
            self.references += 1
            if "DOCREF" in element.attrib:
                document, known = self.documents.get(element.get("DOCREF"), (None, {}))
                if document is None or document.tag != element.get("DOCTYPE"):
                    raise Broken(f"{element.tag}: document {element.get('DOCREF')}")
            else:
                known = ids
            # "POS-RESPONSE-REF" leads to a POS-RESPONSE, and so on; some name what they lead to by its use.
            kinds = {"DOP-REF": ("DATA-OBJECT-PROP", "STRUCTURE", "DYNAMIC-LENGTH-FIELD"), "PARENT-REF": ("PROTOCOL",),
                     "BASIC-STRUCTURE-REF": ("STRUCTURE",), "COMPARAM-REF": ("COMPARAM", "COMPLEX-COMPARAM")}
            if wanted not in known or known[wanted].tag not in kinds.get(element.tag, (element.tag[:-4],)):
                raise Broken(f"{element.tag} {wanted} leads nowhere")

    @staticmethod
    def _names_are_unique(content):
        for parent in content.iter():
            names = [child.findtext("SHORT-NAME") for child in parent if child.find("SHORT-NAME") is not None]
            for name in names:
                if names.count(name) > 1 or not name.replace("_", "a").isalnum() or not name.isascii():
                    raise Broken(f"SHORT-NAME {name} in {parent.tag}")

    # --- messages
    def decode_request(self, message):
        """(service, values) of a request."""
        return self._first(message, None, lambda s: [s.find("REQUEST-REF")])

    def decode_response(self, message, request):
        """(service, values) of the positive or negative response to a request."""
        name, _ = self.decode_request(request)
        service = self.services[name]
        refs = [*service.iter("POS-RESPONSE-REF"), *service.iter("NEG-RESPONSE-REF")]
        return self._first(message, request, lambda s: refs if s is service else [])

    def _first(self, message, request, refs_of):
        for name, service in self.services.items():
            for ref in refs_of(service):
                try:
                    values, end = self._params(self.ids[ref.get("ID-REF")], message, 0, request)
                except Other:
                    continue
                if end != len(message):
                    continue
                return name, values
        raise Other(message.hex())

    def _params(self, holder, message, origin, request=None):
        values, at, end = {}, origin, origin
        for param in holder.find("PARAMS"):
            position = param.findtext("BYTE-POSITION")
            at = at if position is None else origin + int(position)
            value, at = self._param(param, message, at, int(param.findtext("BIT-POSITION") or 0), request)
            values[param.findtext("SHORT-NAME")] = value
            end = max(end, at)
        size = holder.findtext("BYTE-SIZE")
        return values, end if size is None else self._within(message, origin + int(size))

    @staticmethod
    def _within(message, end):
        if end > len(message):
            raise Other("too short")
        return end

    def _param(self, param, message, at, bit, request):
        kind = param.get(TYPE)
        if kind == "CODED-CONST":
            value, end = self._coded(param.find("DIAG-CODED-TYPE"), message, at, bit)
            if value != type(value)(param.findtext("CODED-VALUE")):
                raise Other("another constant")
            return value, end
        if kind == "MATCHING-REQUEST-PARAM":
            length, first = int(param.findtext("BYTE-LENGTH")), int(param.findtext("REQUEST-BYTE-POS"))
            end = self._within(message, at + length)
            if message[at:end] != request[first:first + length]:
                raise Other("answer to something else")
            return message[at:end], end
        if kind != "VALUE":
            raise Broken(f"parameter of type {kind}")
        return self._object(self.ids[param.find("DOP-REF").get("ID-REF")], message, at, bit)

    def _object(self, dop, message, at, bit):
        if dop.tag == "STRUCTURE":
            return self._params(dop, message, at)
        if dop.tag == "DYNAMIC-LENGTH-FIELD":
            counting = dop.find("DETERMINE-NUMBER-OF-ITEMS")
            count, end = self._object(self.ids[counting.find("DATA-OBJECT-PROP-REF").get("ID-REF")], message,
                                      at + int(counting.findtext("BYTE-POSITION")), int(counting.findtext("BIT-POSITION") or 0))
            at, items = at + int(dop.findtext("OFFSET")), []
            for _ in range(count):
                item, at = self._params(self.ids[dop.find("BASIC-STRUCTURE-REF").get("ID-REF")], message, at)
                items.append(item)
            return items, max(at, end)
        raw, end = self._coded(dop.find("DIAG-CODED-TYPE"), message, at, bit)
        return self._in_si(dop, self._physical(dop.find("COMPU-METHOD"), raw)), end

    def _coded(self, coded, message, at, bit):
        base, kind = coded.get("BASE-DATA-TYPE"), coded.get(TYPE)
        if kind == "MIN-MAX-LENGTH-TYPE" and coded.get("TERMINATION") == "END-OF-PDU":
            data, end = message[at:], len(message)
        elif kind == "LEADING-LENGTH-INFO-TYPE":
            width = int(coded.findtext("BIT-LENGTH")) // 8
            begin = self._within(message, at + width)
            end = self._within(message, begin + int.from_bytes(message[at:begin], "big"))
            data = message[begin:end]
        elif kind == "STANDARD-LENGTH-TYPE":
            bits = int(coded.findtext("BIT-LENGTH"))
            end = self._within(message, at + -(-(bit + bits) // 8))
            data = message[at:end]
        else:
            raise Broken(f"coded type {kind}")
        if base == "A_BYTEFIELD":
            return data, end
        if base == "A_ASCIISTRING":
            return data.decode("ascii").rstrip("\0"), end
        low_first = coded.get("IS-HIGHLOW-BYTE-ORDER") in ("false", "0")
        if base in ("A_FLOAT32", "A_FLOAT64"):
            return struct.unpack(("<" if low_first else ">") + ("f" if base == "A_FLOAT32" else "d"), data)[0], end
        if base not in ("A_UINT32", "A_INT32") or bits > 32:
            raise Broken(f"{base} of {bits} bits")
        number = int.from_bytes(data, "little" if low_first else "big") >> bit & (1 << bits) - 1
        if base == "A_INT32" and number >> bits - 1:
            number -= 1 << bits
        return number, end

    @staticmethod
    def _physical(method, raw):
        category = method.findtext("CATEGORY")
        if category == "IDENTICAL":
            return raw
        scales = method.findall("COMPU-INTERNAL-TO-PHYS/COMPU-SCALES/COMPU-SCALE")
        if category == "TEXTTABLE":
            for scale in scales:
                if int(scale.findtext("LOWER-LIMIT")) <= raw <= int(scale.findtext("UPPER-LIMIT")):
                    return scale.findtext("COMPU-CONST/VT")
            raise Other("a number without a word")
        if category != "LINEAR":
            raise Broken(f"method {category}")
        rational = scales[0].find("COMPU-RATIONAL-COEFFS")
        offset, factor = (float(v.text) for v in rational.findall("COMPU-NUMERATOR/V"))
        return (offset + factor * raw) / float(rational.findtext("COMPU-DENOMINATOR/V"))

    def _in_si(self, dop, value):
        ref = dop.find("UNIT-REF")
        if ref is None:
            return value
        unit = self.ids[ref.get("ID-REF")]
        return (value - float(unit.findtext("OFFSET-SI-TO-UNIT"))) / float(unit.findtext("FACTOR-SI-TO-UNIT"))
